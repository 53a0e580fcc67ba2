//! The servo in fake time: from what it hears to a command, cycle by cycle. It does no I/O and reads no clock.
#![warn(clippy::unwrap_used, clippy::expect_used)]
// Both panic where nobody reads: results go through cli::print, all else through stderr.
#![warn(clippy::print_stdout, clippy::print_stderr)]

pub mod servo;
