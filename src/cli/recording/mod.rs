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

/// Why nothing more is recorded.
#[derive(Debug, Error)]
pub enum RecordingError {
    /// The bag.
    #[error(transparent)]
    Bag(#[from] BagError),
    /// The thread that writes ended by itself, or could not start.
    #[error("the thread that writes the bag {0}")]
    Thread(String),
    /// The network of this process has ended.
    #[error("{why}: the bag has the {messages} messages of before")]
    Deaf {
        /// Messages in the bag, which is whole.
        messages: u64,
        /// How it ended.
        why: NetworkEnd,
    },
    /// The recorder's place in the graph.
    #[error(transparent)]
    Ros(#[from] RosError),
}
