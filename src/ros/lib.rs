#![doc = include_str!("README.md")]
#![warn(clippy::unwrap_used, clippy::expect_used)]
// These macros panic if nobody reads the output. Results go through `cli::print`, everything else through `stderr`.
#![warn(clippy::print_stdout, clippy::print_stderr)]

#[cfg(any(test, feature = "test-util"))]
pub mod alone;
mod dds;
pub mod log_file;
pub mod ros;
pub mod stderr;
