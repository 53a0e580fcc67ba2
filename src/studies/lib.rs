//! The reference work repeated, and the comparison of the laws.
#![warn(clippy::unwrap_used, clippy::expect_used)]
// Both panic where nobody reads: results go through cli::print, all else through stderr.
#![warn(clippy::print_stdout, clippy::print_stderr)]

pub mod compare;
pub mod paper;
