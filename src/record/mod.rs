//! Bags: rosbag2 directories, written and read without ROS.
//!
//! [`BagWriter`] writes MCAP files with their `metadata.yaml` as `ros2 bag record` of ROS 2 Jazzy does, [`Recorder`]
//! feeds it from the graph, and [`Bag`] reads what either of them, or `ros2 bag record`, has written. Messages stay the
//! bytes that went over the wire.

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
mod queue;
mod recorder;
mod selection;
mod sqlite_file;
mod storage;
mod unreadable;
mod writer;

pub use bag::Bag;
pub use error::BagError;
pub use message::{BagMessage, Topic};
pub use recorder::Recorder;
pub use selection::Selection;
pub use unreadable::UnreadableParts;
pub use writer::{BagWriter, TopicId, TopicRecord, WriterOptions, WrittenBag};
