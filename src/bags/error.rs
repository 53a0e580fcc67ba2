//! Errors in reading and writing bags.

use dq_common::text::{REASON, shown};
use mcap::McapError;
use std::error::Error as _;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// An error of bags. Each message is one line that names the file.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum BagError {
    /// The directory of a new bag already exists.
    #[error("{0:?} exists already: a recording never overwrites, give it a new directory")]
    Exists(PathBuf),
    /// A file could not be written, for example because of permissions or lack of space.
    #[error("cannot write {path:?}: {why}")]
    Write {
        /// The path of the file.
        path: PathBuf,
        /// The message of the operating system or the MCAP library.
        why: String,
    },
    /// Neither `msg_config/interfaces` nor the `TopicRecord` defines the type.
    #[error("{topic}: type {message} has no definition in msg_config/interfaces, so it cannot be recorded")]
    UnknownType {
        /// The name of the topic.
        topic: String,
        /// The name of the type: `package/msg/Name`.
        message: String,
    },
    /// A topic id was used with another writer than the one that created it.
    #[error("cannot write to {0:?}: the topic belongs to another bag, add it to this one")]
    ForeignTopic(PathBuf),
    /// A file could not be read.
    #[error("cannot read {path:?}: {why}")]
    Read {
        /// The path of the file.
        path: PathBuf,
        /// The error of the operating system.
        why: std::io::Error,
    },
    /// The file or directory is not a bag.
    #[error("{path:?} is not a rosbag2 bag: {why}")]
    NotABag {
        /// The path of the file or directory.
        path: PathBuf,
        /// The reason.
        why: String,
    },
    /// The content of a bag is inconsistent.
    #[error("{path:?} is damaged: {why}")]
    Damaged {
        /// The path of the file.
        path: PathBuf,
        /// Where the damage is, and what it is.
        why: String,
    },
}

impl BagError {
    pub(super) fn write(path: &Path) -> impl FnOnce(std::io::Error) -> Self {
        move |why| Self::Write { path: path.to_owned(), why: why.to_string() }
    }

    pub(super) fn write_mcap(path: &Path) -> impl FnOnce(McapError) -> Self {
        // If the cause is an error of the operating system, the message of that error is clearer.
        let words = |why: McapError| why.source().map_or_else(|| why.to_string(), ToString::to_string);
        move |why| Self::Write { path: path.to_owned(), why: words(why) }
    }

    pub(super) fn read(path: &Path) -> impl FnOnce(std::io::Error) -> Self {
        move |why| Self::Read { path: path.to_owned(), why }
    }

    pub(super) fn not_a_bag(path: &Path, why: impl Into<String>) -> Self {
        Self::NotABag { path: path.to_owned(), why: why.into() }
    }

    pub(super) fn damaged(path: &Path, why: &str) -> Self {
        Self::Damaged { path: path.to_owned(), why: shown(why, REASON) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_full_disk_is_called_so() {
        let full = McapError::Io(std::io::ErrorKind::StorageFull.into());
        let text = BagError::write_mcap(Path::new("run"))(full).to_string();
        assert_eq!(text, "cannot write \"run\": no storage space");
        let text = BagError::write_mcap(Path::new("run"))(McapError::UnexpectedEof).to_string();
        assert!(text.len() > "cannot write \"run\": ".len(), "{text}");
    }
}
