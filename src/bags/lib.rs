#![doc = include_str!("README.md")]
#![warn(clippy::unwrap_used, clippy::expect_used)]
// These macros panic if nobody reads the output. Results go through `cli::print`, everything else through `stderr`.
#![warn(clippy::print_stdout, clippy::print_stderr)]

mod bag;
mod block;
mod error;
mod files;
mod format;
mod mcap_fields;
mod mcap_file;
mod mcap_output;
mod message;
mod metadata;
mod packed;
mod qos;
#[cfg(feature = "sqlite")]
mod sqlite_file;
mod storage;
mod unreadable;
mod writer;

pub use bag::Bag;
pub use dq_messages::messages::Message;
pub use dq_messages::{DurabilityKind, LivelinessKind, OfferedQos, ReliabilityKind};
pub use error::BagError;
pub use message::{BagMessage, Topic};
pub use unreadable::UnreadableParts;
pub use writer::{BagWriter, TopicId, TopicRecord, WriterOptions, WrittenBag};
