//! What every member shares: text that comes from outside, and enums whose variants have names.
#![warn(clippy::unwrap_used, clippy::expect_used)]
// Both panic where nobody reads: results go through cli::print, all else through stderr.
#![warn(clippy::print_stdout, clippy::print_stderr)]

mod names;
pub mod text;
pub mod text_file;

pub use names::UnknownName;
