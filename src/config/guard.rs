//! The guard's parameters.

use super::NodeParameters;
use super::common::{joint_names, realtime_priority, simulated_time, update_rate};
use super::cycle::{command_interface, command_period};
use dq_core::check::GUARDED_PERIODS as PERIODS;
use dq_core::servo::{Interface, JointOrder};
use dq_params::{Declarer, ParameterError};
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
        let realtime_priority = realtime_priority(p);
        let joints = JointOrder::new(joint_names(p)?);
        let interface = command_interface(p);
        let update_period = update_rate(p);
        let period = command_period(p, interface, update_period);
        let seconds = p
            .double("command_timeout", 0.1, 0.02..=10.0)
            .live("s", "time without a command after which an arm that was in motion is stopped; at least three of the servo's periods");
        let command_timeout = Duration::from_secs_f64(seconds);
        if command_timeout < PERIODS * period {
            let expected = format!(
                "at least three of the servo's periods, {} s (update_rate, or trajectory_rate where command_interface is trajectory)",
                (PERIODS * period).as_secs_f64()
            );
            return Err(ParameterError::Invalid {
                name: "command_timeout",
                value: seconds.to_string(),
                expected,
            });
        }
        Ok(Self { joints, interface, command_timeout, realtime_priority })
    }
}
