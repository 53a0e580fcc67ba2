//! Bags: rosbag2 directories, written and read without ROS.
//!
//! [`BagWriter`] writes MCAP files with their `metadata.yaml` as `ros2 bag record` of ROS 2 Jazzy does, [`Recorder`]
//! feeds it from the graph, and [`Bag`] reads what either of them, or `ros2 bag record`, has written. Messages stay the
//! bytes that went over the wire.

mod error;
mod interfaces;
mod mcap_file;
mod metadata;
mod qos;
mod queue;
mod reader;
mod recorder;
mod sqlite_file;
mod writer;

pub use error::BagError;
pub use interfaces::{definition, type_hash};
pub use reader::{Bag, BagMessage, Messages, Topic};
pub use recorder::{Recorder, Selection};
pub use writer::{BagWriter, Summary, TopicId, TopicRecord, WriterOptions};
