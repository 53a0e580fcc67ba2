//! Dual-quaternion control of serial arms: a ROS 2 servo and a simulated arm as nodes, and their parts as a library.
//!
//! Each part is a crate of its own, which this one re-exports under its own name. [`dq_config`] and what it stands on need no ROS; they do no
//! I/O but to read parameter files, robot descriptions and the meshes that these name. [`dq_kinematics`], [`dq_core`] and [`dq_space`] begin
//! with an example each; [`dq_config`] has the way from an arm of your own, as DH rows or a robot description, to its chain, its settings and
//! its servo. The README and `src/guide` are for who uses the program.
#![warn(clippy::unwrap_used, clippy::expect_used)]
// Both panic where nobody reads: results go through cli::print, all else through stderr.
#![warn(clippy::print_stdout, clippy::print_stderr)]

// Every line of Rust on these pages is run.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
mod readme {}
#[cfg(doctest)]
#[doc = include_str!("guide/library.md")]
mod use_as_a_library {}

pub mod cli;

pub use dq_algebra;
pub use dq_bags;
pub use dq_check;
pub use dq_common;
pub use dq_config;
pub use dq_core;
pub use dq_description;
pub use dq_figures;
pub use dq_kinematics;
pub use dq_limits;
pub use dq_link;
pub use dq_messages;
pub use dq_metrics;
pub use dq_nodes;
pub use dq_params;
pub use dq_plant;
pub use dq_ros;
pub use dq_runs;
pub use dq_space;
pub use dq_studies;
pub use dq_view;
pub use dq_wire;
