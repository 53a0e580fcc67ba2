//! Dual-quaternion control of serial arms: a ROS 2 servo and a simulated arm as nodes, and their parts as a library.
//!
//! Each part is a crate of its own, which this one gives its name in the program. [`dq`], [`arm`], [`control`], [`space`], [`frames`],
//! [`servo`], [`check`], [`plant`], [`params`] and [`config`] need no ROS; they do no I/O but to read parameter files, robot descriptions and
//! the meshes that these name. [`arm`], [`control`], [`servo`] and [`frames`] begin with an example each; [`config`] has the way from an arm of
//! your own, as DH rows or a robot description, to its chain, its settings and its servo. The README and `src/guide` are for who uses the program.
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
pub mod recording;
pub mod runs;

pub use dq_algebra as dq;
pub use dq_bags as record;
pub use dq_common::text;
pub use dq_config as config;
pub use dq_core::servo;
pub use dq_figures as draw;
pub use dq_kinematics::{arm, control};
pub use dq_limits::check;
pub use dq_nodes::{nodes, wire};
pub use dq_params as params;
pub use dq_plant as plant;
pub use dq_ros::{ros, stderr};
pub use dq_space::{frames, space};
pub use dq_studies::{compare, paper};
pub use dq_view as view;
