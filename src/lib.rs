//! Dual-quaternion control of serial arms: a ROS 2 servo and a simulated arm as nodes, and their parts as a library.
//!
//! Each part is a crate, re-exported here under its own name. [`dq_config`] and the crates that it imports need no ROS. These
//! crates do no I/O, except to read parameter files, robot descriptions and meshes that the descriptions name. The pages of
//! [`dq_kinematics`], [`dq_core`] and [`dq_space`] begin with an example. [`dq_config`] shows how to make chain, settings and servo
//! from your own arm, given as DH rows or as a robot description. To use the program, read the README and `src/guide`.
#![warn(clippy::unwrap_used, clippy::expect_used)]
// These macros panic if nobody reads the output. Results go through `cli::print`, everything else through `stderr`.
#![warn(clippy::print_stdout, clippy::print_stderr)]

// The Rust examples on these pages are run as tests.
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
pub use dq_contact;
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
pub use dq_search;
pub use dq_space;
pub use dq_studies;
pub use dq_view;
pub use dq_wire;
