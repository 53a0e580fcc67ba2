//! The plant's parameters.

use super::{ArmParameters, NodeParameters};
use crate::arm::{DescribedArm, bounds};
use crate::params::{Declarer, ParameterError};
use std::time::Duration;

/// The plant's parameters, typed and checked as a whole.
#[derive(Clone, Debug, PartialEq)]
pub struct PlantParameters {
    /// The arm.
    pub arm: ArmParameters,
    /// Joint positions at the start and after a reset \[rad, prismatic: m\].
    pub initial_positions: Vec<f64>,
    /// Age at which a command counts as zero.
    pub command_timeout: Duration,
    /// Put before every frame name on `/tf`.
    pub frame_prefix: String,
}

impl NodeParameters for PlantParameters {
    const NODE_NAME: &'static str = "puma560";

    /// All of it: it is published.
    fn description_in_force(text: String, _arm: &DescribedArm) -> String {
        text
    }

    fn declare(p: &mut Declarer) -> Result<Self, ParameterError> {
        let arm = ArmParameters::declare(p)?;
        let initial_positions = p
            .doubles("initial_positions", &[])
            .within(-bounds::JOINT_ANGLE..=bounds::JOINT_ANGLE)
            .required()
            .fixed("rad, m", "joint positions at the start and after ~/reset, one a joint");
        Ok(Self {
            frame_prefix: p
                .string("frame_prefix")
                .fixed("", "put before every frame name on /tf, so that two arms are told apart"),
            command_timeout: Duration::from_secs_f64(
                p.double("command_timeout", 0.1, 0.001..=10.0)
                    .live("s", "age at which a command counts as zero: the arm stops by itself"),
            ),
            initial_positions: initial_positions.exactly(arm.joints.len())?.to_vec(),
            arm,
        })
    }
}
