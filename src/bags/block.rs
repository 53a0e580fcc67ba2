//! Blocks of messages, which are unpacked one at a time.

use super::message::BagMessage;
use dq_common::text::{NAME, shown};

/// A group of messages of a file. All messages of a block are unpacked at the same time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Block {
    /// The earliest log time in the block \[ns\]; `i64::MAX` for a block without messages.
    pub start: i64,
    /// The index of the block in its file.
    pub number: usize,
}

/// The unpacked content of a block.
#[derive(Debug, Default)]
pub(super) struct Unpacked {
    pub messages: Vec<BagMessage>,
    /// The size of the unpacked messages \[bytes\].
    pub bytes: u64,
    /// The parts that were lost, one line each.
    pub lost: Vec<String>,
}

/// The limits for unpacking when a file is opened.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limit {
    /// The largest unpacked size of a file that rosbag2 has compressed as a whole \[bytes\].
    pub room: u64,
    /// The largest total of the unpacked sizes of all chunks in one MCAP file \[bytes\].
    pub work: u64,
}

/// The requested types; `None` for all types.
pub(super) type Types = Option<Vec<String>>;

/// Returns a line for [`Unpacked::lost`] about `count` messages that have another encoding than CDR.
pub(super) fn of_other_encoding(topic: &str, count: u64) -> String {
    format!("{count} messages of {} are skipped, because they are not encoded in CDR", shown(topic, NAME))
}
