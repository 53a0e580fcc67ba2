//! The nodes of the program: receive → convert → step → convert → publish; nothing else.
#![warn(clippy::unwrap_used, clippy::expect_used)]
// Both panic where nobody reads: results go through cli::print, all else through stderr.
#![warn(clippy::print_stdout, clippy::print_stderr)]

#[cfg(test)]
mod allocations;
mod arm_input;
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
mod wiring;

pub use guard::GuardNode;
pub use parameters::Prepared;
pub use plant::PlantNode;
pub use realtime::{RealtimeError, below};
pub use servo::ServoNode;
pub use shutdown::ShutdownError;

use dq_params::ParameterError;
use dq_ros::ros::RosError;
use thiserror::Error;

/// Why a node could not start.
#[derive(Debug, Error)]
pub enum NodeError {
    /// Its parameters.
    #[error(transparent)]
    Config(#[from] ParameterError),
    /// A robot description that came by topic.
    #[error("what came on {topic} does not describe the arm: {why}")]
    Description {
        /// The topic.
        topic: String,
        /// What is wrong with it.
        why: Box<NodeError>,
    },
    /// Its place in the graph.
    #[error(transparent)]
    Ros(#[from] RosError),
    /// The wire contract.
    #[error(transparent)]
    Wire(#[from] dq_messages::WireError),
    /// Its arm.
    #[error(transparent)]
    Arm(#[from] dq_kinematics::arm::ArmError),
    /// Settings that do not fit its arm.
    #[error(transparent)]
    Settings(#[from] dq_core::servo::SettingsError),
    /// The cycle's priority.
    #[error(transparent)]
    Realtime(#[from] RealtimeError),
    /// The operating system gave no thread.
    #[error("no thread for the cycle: {0}")]
    Thread(#[from] std::io::Error),
}
