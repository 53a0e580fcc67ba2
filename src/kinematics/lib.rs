//! Serial arms and the laws that move them: chains by DH rows, Jacobians, and the control laws of the reference work.
#![warn(clippy::unwrap_used, clippy::expect_used)]
// Both panic where nobody reads: results go through cli::print, all else through stderr.
#![warn(clippy::print_stdout, clippy::print_stderr)]

// The example on its page is run.
#[cfg(doctest)]
#[doc = include_str!("README.md")]
mod readme {}

pub mod arm;
pub mod control;
