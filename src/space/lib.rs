//! The space around an arm: its body, its keep-outs and keep-ins, and the frames in which these are given.
#![warn(clippy::unwrap_used, clippy::expect_used)]
// These macros panic if nobody reads the output. Results go through `cli::print`, everything else through `stderr`.
#![warn(clippy::print_stdout, clippy::print_stderr)]

pub mod frames;
pub mod space;
