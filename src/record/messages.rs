//! A bag's messages in order, out of files in which they are not.

use super::error::BagError;
use super::reader::{BagMessage, Block, Place, Storage};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Iterates over a bag's messages; see [`Bag::messages`](super::Bag::messages). Holds the blocks that overlap in time, not more. After an
/// error it goes on with what else there is.
pub struct Messages<'a> {
    files: &'a [Storage],
    waiting: BinaryHeap<Reverse<(i64, u64, Waiting)>>,
    serial: u64,
}

/// What comes at its time: a block to be read, or one of its messages.
enum Waiting {
    Block(usize, Place),
    Message(BagMessage),
}

/// Serial numbers differ, so the heap's order is decided before it comes to this.
impl PartialEq for Waiting {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}
impl Eq for Waiting {}
impl PartialOrd for Waiting {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Waiting {
    fn cmp(&self, _: &Self) -> std::cmp::Ordering {
        std::cmp::Ordering::Equal
    }
}

impl<'a> Messages<'a> {
    /// The messages of these files, in which these blocks are.
    pub(super) fn new(files: &'a [Storage], blocks: impl Iterator<Item = (usize, Block)>) -> Self {
        let mut messages = Self { files, waiting: BinaryHeap::new(), serial: 0 };
        blocks.for_each(|(file, block)| messages.push(block.start, Waiting::Block(file, block.place)));
        messages
    }

    fn push(&mut self, time: i64, waiting: Waiting) {
        self.waiting.push(Reverse((time, self.serial, waiting)));
        self.serial += 1;
    }
}

impl Iterator for Messages<'_> {
    type Item = Result<BagMessage, BagError>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            let Reverse((_, _, waiting)) = self.waiting.pop()?;
            let (file, place) = match waiting {
                Waiting::Message(message) => return Some(Ok(message)),
                Waiting::Block(file, place) => (file, place),
            };
            let (messages, next) = match self.files[file].load(place) {
                Ok(loaded) => loaded,
                Err(error) => return Some(Err(error)),
            };
            messages.into_iter().for_each(|message| self.push(message.log_time, Waiting::Message(message)));
            if let Some(block) = next {
                self.push(block.start, Waiting::Block(file, block.place));
            }
        }
    }
}
