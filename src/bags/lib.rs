//! Bags: rosbag2 directories, written and read without ROS.
//!
//! [`BagWriter`] writes MCAP files with their `metadata.yaml` as `ros2 bag record` of ROS 2 Jazzy does, and [`Bag`]
//! reads what it, or `ros2 bag record`, has written. Messages stay the bytes that went over the wire.
#![warn(clippy::unwrap_used, clippy::expect_used)]
// Both panic where nobody reads: results go through cli::print, all else through stderr.
#![warn(clippy::print_stdout, clippy::print_stderr)]

mod bag;
mod block;
mod error;
mod files;
mod mcap_fields;
mod mcap_file;
mod mcap_output;
mod message;
mod metadata;
mod packed;
mod qos;
mod sqlite_file;
mod storage;
mod unreadable;
mod writer;

pub use bag::Bag;
pub use error::BagError;
pub use message::{BagMessage, Topic};
pub use unreadable::UnreadableParts;
pub use writer::{BagWriter, TopicId, TopicRecord, WriterOptions, WrittenBag};
