//! The guard's parameters.

use super::NodeParameters;
use super::common::{joint_names, realtime_priority, simulated_time};
use super::cycle::command_interface;
use crate::params::{Declarer, ParameterError};
use crate::servo::{Interface, JointOrder};
use std::time::Duration;

/// The guard's parameters, typed and checked as a whole.
#[derive(Clone, Debug, PartialEq)]
pub struct GuardParameters {
    /// The arm's joints.
    pub joints: JointOrder,
    /// What kind of commands it takes.
    pub interface: Interface,
    /// Commands have ceased after so long without one.
    pub command_timeout: Duration,
    /// Of SCHED_FIFO for the guard's thread; 0 for none.
    pub realtime_priority: u8,
}

impl NodeParameters for GuardParameters {
    const NODE_NAME: &'static str = "dq_servo_guard";

    fn declare(p: &mut Declarer) -> Result<Self, ParameterError> {
        // Every ROS 2 node has it; this one stamps nothing.
        simulated_time(p);
        Ok(Self {
            realtime_priority: realtime_priority(p),
            joints: JointOrder::new(joint_names(p)?),
            interface: command_interface(p),
            command_timeout: Duration::from_secs_f64(
                p.double("command_timeout", 0.1, 0.005..=10.0)
                    .live("s", "time without a command after which an arm that was in motion is stopped"),
            ),
        })
    }
}
