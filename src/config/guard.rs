//! The guard's parameters.

use super::NodeParameters;
use super::common::{CycleParameters, JointParameters, TrajectoryParameters};
use dq_check::GUARDED_PERIODS as PERIODS;
use dq_core::servo::{Interface, JointOrder};
use dq_params::{Declarer, ParameterError, Parameters};
use std::time::Duration;

/// The guard's parameters, typed and checked as a whole.
#[derive(Clone, Debug, PartialEq)]
pub struct GuardParameters {
    /// The arm's joints.
    pub joints: JointOrder,
    /// The kind of commands that the arm takes.
    pub interface: Interface,
    /// The time without a command after which the guard stops a moving arm.
    pub command_timeout: Duration,
    /// The SCHED_FIFO priority of the guard's thread; 0 for a normal thread.
    pub realtime_priority: u8,
}

/// The parameters as the guard declares them.
#[derive(Parameters)]
struct DeclaredGuard {
    // The guard does not use stamps, but every ROS 2 node has use_sim_time.
    #[parameter(group)]
    cycle: CycleParameters,
    #[parameter(group)]
    joints: JointParameters,
    #[parameter(group)]
    interface: Interface,
    #[parameter(group)]
    trajectory: TrajectoryParameters,
    /// time without a command after which the guard stops a moving arm; at least three of the servo's periods \[s\]
    #[parameter(default = 0.1, range = 0.02..=10.0)]
    command_timeout: Duration,
}

impl NodeParameters for GuardParameters {
    const NODE_NAME: &'static str = "dq_servo_guard";
}

impl Parameters for GuardParameters {
    fn declare(p: &mut Declarer) -> Result<Self, ParameterError> {
        let DeclaredGuard { cycle, joints, interface, trajectory, command_timeout } =
            DeclaredGuard::declare(p)?;
        let least = PERIODS * trajectory.period(interface, cycle.period());
        if command_timeout < least {
            let expected = format!(
                "at least three of the servo's periods, {} s (update_rate, or trajectory_rate where interface is trajectory)",
                least.as_secs_f64()
            );
            return Err(ParameterError::invalid("command_timeout", command_timeout.as_secs_f64(), expected));
        }
        let joints = JointOrder::new(joints.names()?);
        Ok(Self { joints, interface, command_timeout, realtime_priority: cycle.priority() })
    }
}
