//! The nodes of the program, and what they say over the wire.
#![warn(clippy::unwrap_used, clippy::expect_used)]
// Both panic where nobody reads: results go through cli::print, all else through stderr.
#![warn(clippy::print_stdout, clippy::print_stderr)]

#[cfg(test)]
#[path = "../ros/alone.rs"]
mod alone;
pub mod nodes;
#[cfg(test)]
use dq_ros::ros;
pub mod wire;
