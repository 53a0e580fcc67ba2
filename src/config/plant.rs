//! The plant's parameters.

use super::{ArmParameters, NodeParameters, common};
use crate::arm::bounds;
use crate::params::{Constraint, Declaration, ParameterError, ParameterStore, Value};
use std::time::Duration;

/// The plant's parameters, typed and checked as a whole.
#[derive(Clone, Debug, PartialEq)]
pub struct PlantParameters {
    /// The arm.
    pub arm: ArmParameters,
    /// Joint angles at the start and after a reset \[rad\].
    pub initial_positions: Vec<f64>,
    /// Age at which a command counts as zero.
    pub command_timeout: Duration,
    /// Put before every frame name on `/tf`.
    pub frame_prefix: String,
}

impl NodeParameters for PlantParameters {
    const NODE_NAME: &'static str = "puma560";

    fn declarations() -> Vec<Declaration> {
        let mut all = common::declarations();
        all.extend([
            Declaration::fixed(
                "initial_positions",
                Value::DoubleArray(Vec::new()),
                Constraint::Range { min: -bounds::JOINT_ANGLE, max: bounds::JOINT_ANGLE },
                "rad",
                "joint angles at the start and after ~/reset, one a joint",
            )
            .of_every_arm(),
            Declaration::fixed(
                "frame_prefix",
                Value::String(String::new()),
                Constraint::None,
                "",
                "put before every frame name on /tf, so that two arms are told apart",
            ),
            Declaration::live(
                "command_timeout",
                Value::Double(0.1),
                Constraint::Range { min: 0.001, max: 10.0 },
                "s",
                "age at which a command counts as zero: the arm stops by itself",
            ),
        ]);
        all
    }

    fn from_store(store: &ParameterStore) -> Result<Self, ParameterError> {
        let arm = ArmParameters::from_store(store)?;
        Ok(Self {
            initial_positions: store.doubles("initial_positions", arm.joints.len())?.to_vec(),
            command_timeout: Duration::from_secs_f64(store.double("command_timeout")?),
            frame_prefix: store.string("frame_prefix")?.to_owned(),
            arm,
        })
    }
}
