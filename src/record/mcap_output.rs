//! Writes one MCAP file.

use super::error::BagError;
use crate::wire::type_hash;
use mcap::records::MessageHeader;
use mcap::{WriteOptions, Writer};
use std::collections::BTreeMap;
use std::fs::File;
use std::path::PathBuf;

/// A chunk is compressed and written once it holds this many bytes: rosbag2's size.
const CHUNK_SIZE: usize = 768 * 1024;

/// The MCAP file being written.
pub(super) struct McapOutput {
    path: PathBuf,
    /// Unbuffered: the MCAP writer hands over whole chunks, and errors come when they happen.
    writer: Writer<File>,
    /// The same file, to ask for its size and to sync it.
    handle: File,
    /// Bytes of messages that no chunk on disk has yet.
    pending: usize,
}

impl McapOutput {
    /// Begins a file, which is not there yet.
    pub fn create(path: PathBuf) -> Result<Self, BagError> {
        let file = File::create_new(&path).map_err(BagError::write(&path))?;
        let handle = file.try_clone().map_err(BagError::write(&path))?;
        let options = WriteOptions::new()
            .profile("ros2")
            .library(concat!("dq_servo ", env!("CARGO_PKG_VERSION")))
            // Chunks end where this writer says so, and go to the file whole: what a kill cuts off is one chunk.
            .chunk_size(None)
            .disable_seeking(true)
            .compression_threads(0);
        let writer = options.create(file).map_err(BagError::write_mcap(&path))?;
        let mut open = Self { path, writer, handle, pending: 0 };
        open.flush()?;
        Ok(open)
    }

    /// A channel for a topic with its type, definition and offered QoS (YAML).
    pub fn add(&mut self, name: &str, message: &str, definition: &str, qos: &str) -> Result<u16, BagError> {
        let metadata = BTreeMap::from([
            ("offered_qos_profiles".to_owned(), qos.to_owned()),
            ("topic_type_hash".to_owned(), type_hash(message).to_owned()),
        ]);
        self.writer
            .add_schema(message, "ros2msg", definition.as_bytes())
            .and_then(|schema| self.writer.add_channel(schema, name, "cdr", &metadata))
            .map_err(BagError::write_mcap(&self.path))
    }

    /// Writes a message into the open chunk.
    pub fn write(
        &mut self,
        channel: u16,
        log_time: i64,
        publish_time: i64,
        cdr: &[u8],
    ) -> Result<(), BagError> {
        let time = |time: i64| u64::try_from(time).unwrap_or(0);
        let header = MessageHeader {
            channel_id: channel,
            sequence: 0,
            log_time: time(log_time),
            publish_time: time(publish_time),
        };
        self.pending += cdr.len();
        self.writer.write_to_known_channel(&header, cdr).map_err(BagError::write_mcap(&self.path))?;
        if self.pending >= CHUNK_SIZE { self.flush() } else { Ok(()) }
    }

    /// Ends the open chunk, and brings it to disk.
    pub fn flush(&mut self) -> Result<(), BagError> {
        self.pending = 0;
        self.writer.flush().map_err(BagError::write_mcap(&self.path))
    }

    /// Writes index and footer, and waits for the disk.
    pub fn close(&mut self) -> Result<(), BagError> {
        self.writer.finish().map_err(BagError::write_mcap(&self.path))?;
        self.handle.sync_all().map_err(BagError::write(&self.path))
    }

    /// Bytes on disk.
    pub fn size(&self) -> u64 {
        self.handle.metadata().map_or(0, |metadata| metadata.len())
    }
}
