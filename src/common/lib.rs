//! What every member shares: text that comes from outside, and enums whose variants have names.

mod names;
pub mod text;
pub mod text_file;

pub use names::UnknownName;
