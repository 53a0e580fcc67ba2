//! One file of a bag, in any format. It consists of blocks of messages, which are unpacked one at a time.

use super::block::{Block, Limit, Types, Unpacked};
use super::error::BagError;
use super::format::Format;
use super::mcap_file::McapFile;
use super::message::Topic;
use super::packed;
#[cfg(feature = "sqlite")]
use super::sqlite_file::SqliteFile;
use super::unreadable::UnreadableParts;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// One file of a bag.
#[derive(Debug)]
pub(super) struct Storage {
    path: PathBuf,
    format: Box<dyn Format>,
    /// The unpacked file, if rosbag2 has compressed the whole file. The unpacked file is deleted when this value is dropped.
    _unpacked: Option<NamedTempFile>,
}

impl Storage {
    /// Opens a file. Unpacks at most as many bytes as `limit` allows.
    ///
    /// # Errors
    /// [`BagError::Read`], [`BagError::NotABag`], [`BagError::Damaged`].
    pub fn open(path: &Path, limit: Limit, losses: &mut UnreadableParts) -> Result<Self, BagError> {
        let mut magic = read_magic(path)?;
        let unpacked =
            packed::is_packed(&magic).then(|| packed::unpack_file(path, limit.room, losses)).transpose()?;
        let data = unpacked.as_ref().map_or(path, NamedTempFile::path);
        if unpacked.is_some() {
            magic = read_magic(data)?;
        }
        let format: Box<dyn Format> = match magic.as_slice() {
            [] => return Err(BagError::not_a_bag(path, "it is empty")),
            start if mcap::MAGIC.starts_with(start) || start.starts_with(mcap::MAGIC) => Box::new(
                McapFile::open(data, limit, |what| losses.add(path, what)).map_err(BagError::read(path))?,
            ),
            #[cfg(feature = "sqlite")]
            b"SQLite format 3\0" => Box::new(SqliteFile::open(path, data, |what| losses.add(path, what))?),
            #[cfg(not(feature = "sqlite"))]
            b"SQLite format 3\0" => {
                let why =
                    "it is a SQLite file, and this build reads only MCAP: convert it by ros2 bag convert";
                return Err(BagError::read(path)(std::io::Error::new(std::io::ErrorKind::Unsupported, why)));
            }
            _ => return Err(BagError::not_a_bag(path, "it is neither an MCAP nor a SQLite file")),
        };
        Ok(Self { path: path.to_owned(), format, _unpacked: unpacked })
    }

    /// Returns the path of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the blocks of the file. [`load`](Self::load) unpacks one of them.
    pub fn blocks(&self) -> Vec<Block> {
        self.format.blocks()
    }

    /// Unpacks a block. Returns at most `room` bytes of requested messages.
    pub fn load(&mut self, number: usize, types: &Types, room: u64) -> Unpacked {
        let mut unpacked = self.format.load(number, types, room);
        packed::unpack_messages(&mut unpacked, room);
        unpacked
    }

    /// Returns the topics, with the numbers of messages in the blocks that were unpacked so far.
    pub fn topics(&self) -> Vec<Topic> {
        self.format.topics()
    }

    /// Returns the parts that are missing, one line each. Call it after all blocks were unpacked.
    pub fn missing(&self) -> Vec<String> {
        self.format.missing()
    }
}

/// Returns the first bytes of a file, at most sixteen. Opens only regular files, because opening other files may block forever.
fn read_magic(path: &Path) -> Result<Vec<u8>, BagError> {
    if !std::fs::metadata(path).map_err(BagError::read(path))?.is_file() {
        return Err(BagError::not_a_bag(path, "it is not a regular file"));
    }
    let mut magic = Vec::new();
    let file = File::open(path).map_err(BagError::read(path))?;
    file.take(16).read_to_end(&mut magic).map_err(BagError::read(path))?;
    Ok(magic)
}
