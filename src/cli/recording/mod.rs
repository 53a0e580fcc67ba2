//! Recording of a running graph into a bag.

mod queue;
mod recorder;
mod selection;

pub use queue::Progress;
pub use recorder::Recorder;
pub use selection::Selection;

use dq_bags::BagError;
use dq_ros::ros::{NetworkEnd, RosError};
use thiserror::Error;

/// The reason why the recording has ended.
#[derive(Debug, Error)]
pub enum RecordingError {
    /// The bag cannot be written.
    #[error(transparent)]
    Bag(#[from] BagError),
    /// The writing thread ended early, or could not start.
    #[error("the thread that writes the bag {0}")]
    Thread(String),
    /// This process has lost the network.
    #[error("{why}: the bag has the {messages} messages received before")]
    Deaf {
        /// The number of messages in the bag. The bag has all messages that arrived before the loss.
        messages: u64,
        /// The cause of the loss.
        why: NetworkEnd,
    },
    /// The recorder cannot take part in the graph.
    #[error(transparent)]
    Ros(#[from] RosError),
}
