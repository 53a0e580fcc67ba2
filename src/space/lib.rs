//! Where an arm is: its body among what it must keep out of or stay in, and the frames in which that is given.
#![warn(clippy::unwrap_used, clippy::expect_used)]
// Both panic where nobody reads: results go through cli::print, all else through stderr.
#![warn(clippy::print_stdout, clippy::print_stderr)]

pub mod frames;
pub mod space;
