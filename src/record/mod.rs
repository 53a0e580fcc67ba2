//! Bags: rosbag2 directories, written and read without ROS.
//!
//! [`BagWriter`] writes MCAP files with their `metadata.yaml` as `ros2 bag record` of ROS 2 Jazzy does, [`Recorder`]
//! feeds it from the graph, and [`Bag`] reads what either of them, or `ros2 bag record`, has written. Messages stay the
//! bytes that went over the wire.

mod error;
mod files;
mod interfaces;
mod mcap_file;
mod mcap_output;
mod mcap_records;
mod messages;
mod metadata;
mod qos;
mod queue;
mod reader;
mod recorder;
mod selection;
mod sqlite_file;
mod writer;

pub use error::BagError;
pub use interfaces::{definition, type_hash};
pub use messages::Messages;
pub use reader::{Bag, BagMessage, Topic};
pub use recorder::Recorder;
pub use selection::Selection;
pub use writer::{BagWriter, Summary, TopicId, TopicRecord, WriterOptions};
