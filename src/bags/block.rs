//! Blocks of messages, which are unpacked one at a time.

use super::message::BagMessage;
use dq_common::text::{NAME, shown};

/// Some messages of a file that are unpacked together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Block {
    /// When the first message in it was recorded \[ns\], as far as the file says so.
    pub start: i64,
    /// Which one of its file, in the order in which they are stored.
    pub number: usize,
}

/// What a block holds.
#[derive(Debug, Default)]
pub(super) struct Unpacked {
    pub messages: Vec<BagMessage>,
    /// The bytes of these messages.
    pub bytes: u64,
    /// What was lost, a line each.
    pub lost: Vec<String>,
}

/// How much may be unpacked \[bytes\].
#[derive(Clone, Copy, Debug)]
pub(super) struct Limit {
    /// Of messages that are wanted.
    pub room: u64,
    /// Of the chunks of a file.
    pub work: u64,
}

/// The types whose messages are wanted; `None` for all.
pub(super) type Types = Option<Vec<String>>;

/// What is said of messages that another middleware has encoded.
pub(super) fn of_other_encoding(topic: &str, count: u64) -> String {
    format!("{count} messages of {} are passed over, as they are not encoded in CDR", shown(topic, NAME))
}
