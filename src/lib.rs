//! Pose servoing of serial arms with dual quaternions, as a ROS 2 program in pure Rust.
//!
//! Data flows one way: message in → state → law → limits → command out.

pub mod arm;
pub mod config;
pub mod control;
pub mod dq;
pub mod plant;
pub mod servo;

#[cfg(feature = "ros")]
pub mod cli;
#[cfg(feature = "ros")]
pub mod nodes;
#[cfg(feature = "ros")]
pub mod ros;
