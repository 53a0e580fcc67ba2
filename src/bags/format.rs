//! The interface of the readers for the formats MCAP and SQLite.

use super::block::{Block, Types, Unpacked};
use super::message::Topic;

/// A reader of a bag's file. Each format has its own reader.
pub(super) trait Format: std::fmt::Debug + Send {
    /// Returns the blocks of the file. The messages of different blocks may overlap in time.
    fn blocks(&self) -> Vec<Block>;

    /// Unpacks a block, and returns its messages of the requested `types`. Returns at most `room` bytes of messages.
    fn load(&mut self, number: usize, types: &Types, room: u64) -> Unpacked;

    /// Returns the topics, each with the number of its messages that were loaded so far.
    fn topics(&self) -> Vec<Topic>;

    /// Returns the parts that were not read, one line each. Call it after all blocks were loaded.
    fn missing(&self) -> Vec<String>;
}
