//! Serial arms and the laws that move them: chains from DH rows, Jacobians, and control laws.
#![warn(clippy::unwrap_used, clippy::expect_used)]
// These macros panic if nobody reads the output. Results go through `cli::print`, everything else through `stderr`.
#![warn(clippy::print_stdout, clippy::print_stderr)]

// Runs the example in the README as a doctest.
#[cfg(doctest)]
#[doc = include_str!("README.md")]
mod readme {}

pub mod arm;
pub mod control;
