#![doc = include_str!("README.md")]
#![warn(clippy::unwrap_used, clippy::expect_used)]
// These macros panic if nobody reads the output. Results go through `cli::print`, everything else through `stderr`.
#![warn(clippy::print_stdout, clippy::print_stderr)]

#[cfg(test)]
mod allocations;
mod arm_input;
mod arm_speed;
mod commands;
mod complaint;
mod cycle_thread;
mod description;
mod events;
mod frames;
mod guard;
mod guards;
mod in_force;
mod keep_outs;
mod node_setup;
mod outputs;
mod parameters;
mod pictures;
mod plant;
mod realtime;
mod report;
mod requests;
mod rivals;
mod ros_inputs;
mod searcher;
mod sender_clock;
mod senders;
mod servo;
mod shutdown;
mod snapshot;
mod throttle;
mod two_arms;
mod wrench_input;

pub use guard::GuardNode;
pub use parameters::{NodeArguments, Prepared};
pub use plant::PlantNode;
pub use realtime::{RealtimeError, below};
pub use servo::ServoNode;
pub use shutdown::ShutdownError;

use dq_params::ParameterError;
use dq_ros::ros::RosError;
use thiserror::Error;

/// The reason why a node could not start.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum NodeError {
    /// Invalid parameters.
    #[error(transparent)]
    Config(#[from] ParameterError),
    /// The robot description from a topic is invalid.
    #[error("what came on {topic} does not describe the arm: {why}")]
    Description {
        /// The name of the topic.
        topic: String,
        /// The reason.
        why: Box<NodeError>,
    },
    /// The node cannot join the graph.
    #[error(transparent)]
    Ros(#[from] RosError),
    /// An invalid wire contract.
    #[error(transparent)]
    Wire(#[from] dq_messages::WireError),
    /// An invalid arm.
    #[error(transparent)]
    Arm(#[from] dq_kinematics::arm::ArmError),
    /// Settings that do not match the arm.
    #[error(transparent)]
    Settings(#[from] dq_core::servo::SettingsError),
    /// The cycle cannot get its priority.
    #[error(transparent)]
    Realtime(#[from] RealtimeError),
    /// The operating system created no thread.
    #[error("no thread for the cycle: {0}")]
    Thread(#[from] std::io::Error),
}
