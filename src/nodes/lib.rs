//! The nodes of the program, and what they say over the wire.

#[cfg(test)]
#[path = "../ros/alone.rs"]
mod alone;
pub mod nodes;
#[cfg(test)]
use dq_ros::ros;
pub mod wire;
