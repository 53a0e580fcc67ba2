//! Reads a rosbag2 bag once, from the first message to the last. The bag is a directory, an MCAP file or a SQLite file.

use super::block::{Block, Limit, Types};
use super::error::BagError;
use super::files::files_of;
use super::message::{BagMessage, Topic};
use super::storage::Storage;
use super::unreadable::UnreadableParts;
use std::cmp::Reverse;
use std::collections::BTreeMap;
use std::path::Path;

/// An upper bound for a number of bytes: `least` bytes, plus `ratio` times the size of the bag.
struct Bound {
    least: u64,
    ratio: u64,
}

/// The bound for the total size of the messages that a [`Bag`] returns, and for the size of each file that it unpacks. No recording
/// reaches the ratio of 100: zstd compresses even the messages of an arm at rest only to about a twentieth of their size.
const ROOM: Bound = Bound { least: 64 << 20, ratio: 100 };

/// The bound for the total unpacked size of the chunks of an MCAP file, all of which are checked when the file is opened. It is
/// higher than [`ROOM`], because images and maps of one color compress well. The check takes time, but no memory.
const WORK: Bound = Bound { least: 1 << 30, ratio: 2000 };

/// If several blocks overlap in time, the bag keeps their messages in memory at the same time. It unpacks the next block only while
/// these messages have fewer bytes than this.
const OVERLAP: usize = 64 << 20;

/// A bag, and an iterator over its messages in the order of log time. Messages with equal times keep their stored order.
///
/// The bag unpacks each block of a file when the block's earliest message is next in time. So the memory needed depends on how much
/// the blocks overlap, not on the size of the bag. [`Bag::losses`] lists the parts that could not be read.
#[derive(Debug)]
pub struct Bag {
    files: Vec<Storage>,
    /// The blocks that are not unpacked yet, each with the index of its file. The next block to unpack is at the end.
    blocks: Vec<(usize, Block)>,
    /// The messages that are unpacked but not returned yet.
    waiting: BTreeMap<Turn, BagMessage>,
    /// The size of the waiting messages \[bytes\].
    held: usize,
    /// The number of bytes of messages that the bag may still return.
    room: u64,
    types: Types,
    losses: UnreadableParts,
}

/// The position of a message in the order of returned messages: by log time, then by file, then by position in the file.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Turn {
    log_time: i64,
    file: usize,
    block: usize,
    index: usize,
}

impl Bag {
    /// Opens a bag's directory, with or without `metadata.yaml`, or one of its files. Keeps no messages in memory yet.
    ///
    /// # Errors
    /// [`BagError::Read`], [`BagError::NotABag`]; [`BagError::Damaged`] if none of the files can be read.
    pub fn open(path: &Path) -> Result<Self, BagError> {
        let mut losses = UnreadableParts::default();
        let paths = if path.is_dir() { files_of(path, &mut losses)? } else { vec![path.to_owned()] };
        let size: u64 = paths.iter().filter_map(|path| Some(std::fs::metadata(path).ok()?.len())).sum();
        let [room, work] =
            [ROOM, WORK].map(|bound| bound.ratio.saturating_mul(size).saturating_add(bound.least));
        let limit = Limit { room, work };
        let (mut files, mut first_error) = (Vec::new(), None);
        for path in &paths {
            match Storage::open(path, limit, &mut losses) {
                Ok(file) => files.push(file),
                Err(why) => {
                    losses.add_line(why.to_string());
                    first_error.get_or_insert(why);
                }
            }
        }
        if let Some(why) = first_error.filter(|_| files.is_empty()) {
            return Err(why);
        }
        let numbered = files.iter().enumerate();
        let mut blocks: Vec<_> = numbered
            .flat_map(|(file, storage)| storage.blocks().into_iter().map(move |block| (file, block)))
            .collect();
        blocks.sort_by_key(|(file, block)| Reverse((block.start, *file, block.number)));
        Ok(Self { files, blocks, waiting: BTreeMap::new(), held: 0, room, types: None, losses })
    }

    /// Limits the bag to messages of these types (`package/msg/Name`), and returns it.
    #[must_use]
    pub fn only(mut self, types: &[impl AsRef<str>]) -> Self {
        self.give_only(types);
        self
    }

    /// From now on, reads only messages of these types (`package/msg/Name`).
    pub fn give_only(&mut self, types: &[impl AsRef<str>]) {
        self.types = Some(types.iter().map(|name| name.as_ref().to_owned()).collect());
    }

    /// Returns the topics that were found so far, sorted by name. The list is complete after the last message.
    pub fn topics(&self) -> Vec<Topic> {
        let mut counts = BTreeMap::new();
        for topic in self.files.iter().flat_map(Storage::topics) {
            *counts.entry((topic.name, topic.message)).or_insert(0) += topic.count;
        }
        counts.into_iter().map(|((name, message), count)| Topic { name, message, count }).collect()
    }

    /// Returns the parts that could not be read so far.
    pub fn losses(&self) -> &UnreadableParts {
        &self.losses
    }

    /// Unpacks a block of a file, and adds its messages to the waiting ones.
    fn load(&mut self, file: usize, block: usize) {
        let storage = &mut self.files[file];
        let unpacked = storage.load(block, &self.types, self.room);
        unpacked.lost.iter().for_each(|what| self.losses.add(storage.path(), what));
        for (index, message) in unpacked.messages.into_iter().enumerate() {
            self.held += message.cdr.len();
            self.room = self.room.saturating_sub(message.cdr.len() as u64);
            self.waiting.insert(Turn { log_time: message.log_time, file, block, index }, message);
        }
        if self.room == 0 && !self.blocks.is_empty() {
            self.losses.add(
                storage.path(),
                "it unpacks to more than a recording of its size would: the rest is skipped",
            );
            self.blocks.clear();
        }
        if self.blocks.is_empty() && self.losses.is_empty() {
            for file in &self.files {
                file.missing().iter().for_each(|what| self.losses.add(file.path(), what));
            }
        }
    }
}

impl Iterator for Bag {
    type Item = BagMessage;

    fn next(&mut self) -> Option<BagMessage> {
        while let Some((file, block)) = self.blocks.last().copied() {
            // Return the waiting messages before unpacking the next block, if they are earlier than that block, or if they exceed
            // [`OVERLAP`].
            let first = self.waiting.first_key_value();
            if first.is_some_and(|(first, _)| block.start > first.log_time || self.held >= OVERLAP) {
                break;
            }
            self.blocks.pop();
            self.load(file, block.number);
        }
        let (_, message) = self.waiting.pop_first()?;
        self.held -= message.cdr.len();
        Some(message)
    }
}
