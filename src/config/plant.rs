//! The plant's parameters.

use super::cycle::command_interface;
use super::{ArmParameters, NodeParameters};
use crate::arm::{DescribedArm, bounds};
use crate::params::{Declarer, ParameterError};
use crate::plant::Realism;
use crate::servo::Interface;
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
    /// What the robot is like.
    pub realism: Realism,
    /// What kind of commands it takes.
    pub interface: Interface,
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
            interface: command_interface(p),
            realism: realism(p),
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

/// All live, so that a law can be watched while its robot gets worse.
fn realism(p: &mut Declarer) -> Realism {
    let mut time = |name, most, description| {
        Duration::from_secs_f64(p.double(name, 0.0, 0.0..=most).live("s", description))
    };
    let command_latency = time("command_latency", 1.0, "a command takes effect so much after it came");
    let state_latency = time("state_latency", 1.0, "a joint state comes out so much after it was measured");
    let velocity_time_constant = time(
        "velocity_time_constant",
        10.0,
        "a joint goes after a velocity command as a system of first order with it",
    );
    let state_rate = p
        .double("state_rate", 0.0, 0.0..=2000.0)
        .live("Hz", "rate of the joint states, no more than update_rate; 0: update_rate");
    Realism {
        command_latency,
        state_latency,
        velocity_time_constant,
        position_noise: p
            .double("position_noise", 0.0, 0.0..=1.0)
            .live("rad", "each measured position is off by up to this either way"),
        encoder_resolution: p
            .double("encoder_resolution", 0.0, 0.0..=1.0)
            .live("rad", "angle of one count of the encoders; 0: they do not count"),
        state_interval: if state_rate > 0.0 {
            Duration::from_secs_f64(1.0 / state_rate.max(1e-3))
        } else {
            Duration::ZERO
        },
    }
}
