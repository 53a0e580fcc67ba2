//! Reads any rosbag2 bag: a directory, an MCAP file, a SQLite file.

use super::error::BagError;
use super::mcap_file::McapFile;
use super::metadata;
use super::sqlite_file::SqliteFile;
use crate::ros::RosError;
use crate::ros::messages::{self, Message};
use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
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
        messages::decode(&self.cdr)
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

#[derive(Debug)]
enum Storage {
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

    /// The messages of all topics and files in order of log time; of equal times, in the order of the files.
    pub fn messages(&self) -> Messages<'_> {
        let mut messages = Messages { bag: self, waiting: BinaryHeap::new(), serial: 0 };
        for (file, storage) in self.files.iter().enumerate() {
            storage
                .blocks()
                .into_iter()
                .for_each(|block| messages.push(block.start, Waiting::Block(file, block.place)));
        }
        messages
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
    fn load(&self, place: Place) -> Result<(Vec<BagMessage>, Option<Block>), BagError> {
        match (self, place) {
            (Self::Mcap(file), Place::Record { offset, length }) => Ok((file.load(offset, length)?, None)),
            (Self::Sqlite(file), Place::Rows { time, id }) => file.load(time, id),
            (Self::Mcap(_), Place::Rows { .. }) | (Self::Sqlite(_), Place::Record { .. }) => {
                Ok((Vec::new(), None))
            }
        }
    }
}

/// Iterates over a bag's messages; see [`Bag::messages`]. Holds the blocks that overlap in time, not more. After an
/// error it goes on with what else there is.
pub struct Messages<'a> {
    bag: &'a Bag,
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

impl Messages<'_> {
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
            let (messages, next) = match self.bag.files[file].load(place) {
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

/// The files of a bag's directory in their order.
fn files_of(directory: &Path) -> Result<Vec<PathBuf>, BagError> {
    let Some(metadata) = metadata::read(directory)? else { return list(directory) };
    if !metadata.compression_format.is_empty() {
        let what = format!("{}, mode {}", metadata.compression_format, metadata.compression_mode);
        return Err(compressed(directory, &what));
    }
    if metadata.relative_file_paths.is_empty() {
        return Err(BagError::not_a_bag(directory, "its metadata name no files"));
    }
    // Old versions put the directory's name before the file's; a bag's files are in its directory.
    let in_directory = |path: &String| Some(directory.join(Path::new(path).file_name()?));
    Ok(metadata.relative_file_paths.iter().filter_map(in_directory).collect())
}

/// The bag's files where no metadata name them, by the number at the end of their names.
fn list(directory: &Path) -> Result<Vec<PathBuf>, BagError> {
    let entries = directory.read_dir().map_err(BagError::read(directory))?;
    let has = |path: &Path, extension: &str| path.extension().is_some_and(|it| it == extension);
    let paths: Vec<_> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    if let Some(packed) = paths.iter().find(|path| has(path, "zstd")) {
        return Err(compressed(packed, "zstd, whole files"));
    }
    let mut files: Vec<_> = paths.into_iter().filter(|path| has(path, "mcap") || has(path, "db3")).collect();
    if files.is_empty() {
        return Err(BagError::not_a_bag(directory, "it has no metadata.yaml and no .mcap or .db3 file"));
    }
    files.sort_by_cached_key(|path| (number(path), path.clone()));
    Ok(files)
}

/// 12 of `run_12.mcap`.
fn number(path: &Path) -> Option<u64> {
    path.file_stem()?.to_str()?.rsplit_once('_')?.1.parse().ok()
}

/// The file's first bytes, sixteen if there are as many.
fn read_magic(path: &Path) -> std::io::Result<Vec<u8>> {
    let mut magic = Vec::new();
    File::open(path)?.take(16).read_to_end(&mut magic)?;
    Ok(magic)
}

fn compressed(path: &Path, what: &str) -> BagError {
    BagError::Compressed { path: path.to_owned(), what: what.to_owned() }
}
