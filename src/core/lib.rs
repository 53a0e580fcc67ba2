//! The servo in fake time: it turns its inputs into one command per cycle. It does no I/O and reads no clock.
#![warn(clippy::unwrap_used, clippy::expect_used)]
// These macros panic if nobody reads the output. Results go through `cli::print`, everything else through `stderr`.
#![warn(clippy::print_stdout, clippy::print_stderr)]

pub mod servo;
