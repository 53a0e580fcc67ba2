//! Dual-quaternion control of serial arms: a ROS 2 servo and a simulated arm as nodes, and their parts as a library.
//!
//! Without features this is the part that needs no ROS: [`dq`], [`arm`], [`control`], [`space`], [`frames`], [`servo`], [`check`], [`plant`],
//! [`params`] and [`config`]. It does no I/O but to read parameter files, robot descriptions and the meshes that these name. [`arm`],
//! [`control`], [`servo`] and [`frames`] begin with an example each; [`config`] has the way from an arm of your own, as DH rows or a robot description, to its chain, its settings and its servo. The feature
//! `ros` adds the nodes and their command line, `tools` bags, figures, the page, the reference work and the comparison. The README and
//! `src/guide` are for who uses the program.
#![warn(clippy::unwrap_used, clippy::expect_used)]
// Both panic where nobody reads: results go through cli::print, all else through stderr.
#![warn(clippy::print_stdout, clippy::print_stderr)]

// Every line of Rust on these pages is run.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
mod readme {}
#[cfg(all(doctest, feature = "tools"))]
#[doc = include_str!("guide/library.md")]
mod use_as_a_library {}

pub mod arm;
pub mod check;
pub mod config;
pub mod control;
pub mod dq;
pub mod frames;
mod mesh_file;
pub mod params;
pub mod plant;
pub mod servo;
pub mod space;
pub mod text;
mod text_file;

#[cfg(feature = "ros")]
pub mod cli;
#[cfg(feature = "ros")]
mod colors;
#[cfg(feature = "tools")]
pub mod compare;
#[cfg(feature = "ros")]
pub mod dds;
#[cfg(feature = "tools")]
pub mod draw;
#[cfg(feature = "ros")]
mod log_file;
#[cfg(feature = "ros")]
pub mod nodes;
#[cfg(feature = "tools")]
pub mod paper;
#[cfg(feature = "python")]
mod python;
#[cfg(feature = "tools")]
pub mod record;
#[cfg(feature = "ros")]
pub mod ros;
#[cfg(feature = "tools")]
pub mod runs;
#[cfg(feature = "ros")]
pub mod stderr;
#[cfg(feature = "tools")]
pub mod view;
#[cfg(feature = "ros")]
pub mod wire;
