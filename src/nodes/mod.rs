//! The nodes: receive → convert → step → convert → publish; nothing else.

mod cycle_thread;
mod parameters;
mod plant;
mod servo;
mod status_message;

pub use parameters::Prepared;
pub use plant::PlantNode;
pub use servo::ServoNode;
pub use status_message::StatusReport;

use crate::config::ConfigError;
use crate::ros::RosError;
use thiserror::Error;

/// Why a node could not start.
#[derive(Debug, Error)]
pub enum NodeError {
    /// Its parameters.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// Its place in the graph.
    #[error(transparent)]
    Ros(#[from] RosError),
    /// Its arm.
    #[error(transparent)]
    Arm(#[from] crate::arm::ArmError),
    /// The operating system gave no thread.
    #[error("no thread for the cycle: {0}")]
    Thread(#[from] std::io::Error),
}

/// The nodes' default names.
pub const SERVO_NAME: &str = "dq_servo";
/// The plant's default name.
pub const PLANT_NAME: &str = "puma560";
