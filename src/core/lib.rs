//! The servo: each cycle turns the inputs since the last cycle into one command. The crate does no I/O and reads no clock: time is
//! an argument.
#![warn(clippy::unwrap_used, clippy::expect_used)]
// These macros panic if nobody reads the output. Results go through `cli::print`, everything else through `stderr`.
#![warn(clippy::print_stdout, clippy::print_stderr)]

pub mod servo;
