//! Reads any rosbag2 bag once, from its first message to its last: a directory, an MCAP file, a SQLite file.

use super::block::{Block, Limit, Types};
use super::error::BagError;
use super::files::files_of;
use super::message::{BagMessage, Topic};
use super::storage::Storage;
use super::unreadable::UnreadableParts;
use std::cmp::Reverse;
use std::collections::BTreeMap;
use std::path::Path;

/// How many bytes at most: so many for each byte of the bag, and the least besides.
struct Bound {
    least: u64,
    ratio: u64,
}

/// So much may the messages be that are given: no more is believed to be a recording. What zstd makes of the messages of an arm at rest is
/// about a twentieth of them.
const ROOM: Bound = Bound { least: 64 << 20, ratio: 100 };

/// The same of the chunks that are unpacked for them: images and maps of one colour may be there, which take time but no room.
const WORK: Bound = Bound { least: 1 << 30, ratio: 2000 };

/// Blocks that overlap in time are unpacked together as long as their messages have fewer bytes than this.
const OVERLAP: usize = 64 << 20;

/// A bag, and an iterator over its messages in order of log time; of equal times, as they are stored.
///
/// Each block of its files is unpacked once, when its time has come, so that memory is bounded by how much blocks overlap and not by
/// how much there is. What is not read, as it is damaged, is listed in [`Bag::losses`].
#[derive(Debug)]
pub struct Bag {
    files: Vec<Storage>,
    /// File and block, the next one last.
    blocks: Vec<(usize, Block)>,
    /// Messages whose turn has not come.
    waiting: BTreeMap<Turn, BagMessage>,
    /// Bytes of the messages that wait.
    held: usize,
    /// Bytes of messages that may still be given.
    room: u64,
    types: Types,
    losses: UnreadableParts,
}

/// When a message is given: at its log time, then by where it is stored.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Turn {
    log_time: i64,
    file: usize,
    block: usize,
    index: usize,
}

impl Bag {
    /// Opens a bag's directory, with or without `metadata.yaml`, or one of its files. No message is unpacked yet.
    ///
    /// # Errors
    /// [`BagError::Read`], [`BagError::NotABag`], [`BagError::Damaged`] where no file of it can be read at all.
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

    /// The same bag, of which only the messages of these types (`package/msg/Name`) are given.
    #[must_use]
    pub fn only(mut self, types: &[impl AsRef<str>]) -> Self {
        self.give_only(types);
        self
    }

    /// Gives from now on only the messages of these types.
    pub fn give_only(&mut self, types: &[impl AsRef<str>]) {
        self.types = Some(types.iter().map(|name| name.as_ref().to_owned()).collect());
    }

    /// The topics that have been met, by name; all of them once the last message has been given.
    pub fn topics(&self) -> Vec<Topic> {
        let mut counts = BTreeMap::new();
        for topic in self.files.iter().flat_map(Storage::topics) {
            *counts.entry((topic.name, topic.message)).or_insert(0) += topic.count;
        }
        counts.into_iter().map(|((name, message), count)| Topic { name, message, count }).collect()
    }

    /// What could not be read of it so far.
    pub fn losses(&self) -> &UnreadableParts {
        &self.losses
    }

    /// Unpacks the next block.
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
                "it unpacks to more than a recording of its size would: the rest is passed over",
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
            // More than is held at once is given block by block.
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
