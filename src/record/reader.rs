//! Reads any rosbag2 bag: a directory, an MCAP file, a SQLite file.

use super::error::BagError;
use super::files::{compressed, files_of};
use super::mcap_file::McapFile;
use super::messages::Messages;
use super::sqlite_file::SqliteFile;
use crate::ros::RosError;
use crate::ros::messages::{Message, decode};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::Path;
use std::sync::Arc;

/// One topic of a bag.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Topic {
    /// The fully qualified name.
    pub name: String,
    /// `package/msg/Name`.
    pub message: String,
    /// Messages in the bag.
    pub count: u64,
}

/// One message of a bag.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BagMessage {
    /// The topic's fully qualified name.
    pub topic: Arc<str>,
    /// `package/msg/Name`.
    pub message: Arc<str>,
    /// When it was recorded \[ns\] since the Unix epoch.
    pub log_time: i64,
    /// The CDR bytes with their encapsulation header of four bytes.
    pub cdr: Vec<u8>,
}

impl BagMessage {
    /// The message as a value.
    ///
    /// # Errors
    /// [`RosError::Decode`] where it is of another type, or its bytes are no whole message.
    pub fn decode<M: Message>(&self) -> Result<M, RosError> {
        if *self.message != *M::TYPE {
            let why = format!("they are a {} of {}", self.message, self.topic);
            return Err(RosError::Decode { message: M::TYPE, bytes: self.cdr.len(), why });
        }
        decode(&self.cdr)
    }
}

/// A bag that has been looked through.
#[derive(Debug)]
pub struct Bag {
    files: Vec<Storage>,
    topics: Vec<Topic>,
    truncated: bool,
}

/// What opening one file has found.
pub(super) struct Contents<F> {
    pub file: F,
    pub topics: Vec<Topic>,
    pub truncated: bool,
}

/// Some messages that are read from a file together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Block {
    /// No message in it is older \[ns\].
    pub start: i64,
    pub place: Place,
}

/// Where a block is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Place {
    /// A record of an MCAP file: a chunk, or a message outside of one \[bytes\].
    Record { offset: u64, length: u64 },
    /// The rows of a SQLite file after that time and id.
    Rows { time: i64, id: i64 },
}

/// One file of a bag.
#[derive(Debug)]
pub(super) enum Storage {
    Mcap(McapFile),
    Sqlite(SqliteFile),
}

impl Bag {
    /// Opens a bag's directory, with or without `metadata.yaml`, or one of its files. Every file is read once.
    ///
    /// # Errors
    /// [`BagError::Read`], [`BagError::NotABag`], [`BagError::Compressed`], [`BagError::Damaged`].
    pub fn open(path: &Path) -> Result<Self, BagError> {
        let paths = if path.is_dir() { files_of(path)? } else { vec![path.to_owned()] };
        let mut bag = Self { files: Vec::new(), topics: Vec::new(), truncated: false };
        let mut topics = BTreeMap::new();
        for file in &paths {
            let contents = match Storage::open(file)? {
                Some(contents) => contents,
                // A recorder that was killed as it began the file.
                None if path.is_dir() => Contents { file: None, topics: Vec::new(), truncated: true },
                None => return Err(BagError::not_a_bag(file, "it is empty")),
            };
            bag.files.extend(contents.file);
            bag.truncated |= contents.truncated;
            for topic in contents.topics {
                *topics.entry((topic.name, topic.message)).or_insert(0) += topic.count;
            }
        }
        if bag.files.is_empty() {
            return Err(BagError::not_a_bag(path, "its files are empty"));
        }
        bag.topics =
            topics.into_iter().map(|((name, message), count)| Topic { name, message, count }).collect();
        Ok(bag)
    }

    /// The topics, by name.
    pub fn topics(&self) -> &[Topic] {
        &self.topics
    }

    /// Whether a file ends before its end, as after a recorder was killed: what is whole in it is read.
    pub fn truncated(&self) -> bool {
        self.truncated
    }

    /// The messages of all topics and files in order of log time; of equal times, as they are stored.
    pub fn messages(&self) -> Messages<'_> {
        let blocks = |(file, storage): (usize, &Storage)| {
            storage.blocks().into_iter().map(move |block| (file, block)).collect::<Vec<_>>()
        };
        Messages::new(&self.files, self.files.iter().enumerate().flat_map(blocks))
    }
}

impl Storage {
    /// Opens a file by what it begins with; `None` if that is nothing.
    fn open(path: &Path) -> Result<Option<Contents<Option<Self>>>, BagError> {
        let magic = read_magic(path).map_err(BagError::read(path))?;
        let contents = match magic.as_slice() {
            [] => return Ok(None),
            start if mcap::MAGIC.starts_with(start) || start.starts_with(mcap::MAGIC) => {
                let Contents { file, topics, truncated } = McapFile::open(path)?;
                Contents { file: Some(Self::Mcap(file)), topics, truncated }
            }
            b"SQLite format 3\0" => {
                let Contents { file, topics, truncated } = SqliteFile::open(path)?;
                Contents { file: Some(Self::Sqlite(file)), topics, truncated }
            }
            [0x28, 0xb5, 0x2f, 0xfd, ..] => return Err(compressed(path, "zstd, whole files")),
            _ => return Err(BagError::not_a_bag(path, "it is neither an MCAP nor a SQLite file")),
        };
        Ok(Some(contents))
    }

    fn blocks(&self) -> Vec<Block> {
        match self {
            Self::Mcap(file) => file.blocks().to_vec(),
            Self::Sqlite(file) => file.first().into_iter().collect(),
        }
    }

    /// The messages there, and where the next ones are if no block has been told for them.
    pub fn load(&self, place: Place) -> Result<(Vec<BagMessage>, Option<Block>), BagError> {
        match (self, place) {
            (Self::Mcap(file), Place::Record { offset, length }) => Ok((file.load(offset, length)?, None)),
            (Self::Sqlite(file), Place::Rows { time, id }) => file.load(time, id),
            (Self::Mcap(_), Place::Rows { .. }) | (Self::Sqlite(_), Place::Record { .. }) => {
                Ok((Vec::new(), None))
            }
        }
    }
}

/// The file's first bytes, sixteen if there are as many.
fn read_magic(path: &Path) -> std::io::Result<Vec<u8>> {
    let mut magic = Vec::new();
    File::open(path)?.take(16).read_to_end(&mut magic)?;
    Ok(magic)
}
