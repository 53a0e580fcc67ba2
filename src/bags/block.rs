//! Blocks of messages, which are unpacked one at a time.

use super::message::BagMessage;
use dq_common::text::{NAME, shown};

/// Messages of a file that are unpacked together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Block {
    /// The log time of its first message \[ns\], if the file has it.
    pub start: i64,
    /// The index of the block in its file.
    pub number: usize,
}

/// The content of a block.
#[derive(Debug, Default)]
pub(super) struct Unpacked {
    pub messages: Vec<BagMessage>,
    /// The size of these messages.
    pub bytes: u64,
    /// The losses, one line each.
    pub lost: Vec<String>,
}

/// The largest number of bytes to unpack.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limit {
    /// For the requested messages.
    pub room: u64,
    /// For the chunks of a file.
    pub work: u64,
}

/// The requested types; `None` for all.
pub(super) type Types = Option<Vec<String>>;

/// Returns the line about messages with another encoding.
pub(super) fn of_other_encoding(topic: &str, count: u64) -> String {
    format!("{count} messages of {} are skipped, because they are not encoded in CDR", shown(topic, NAME))
}
