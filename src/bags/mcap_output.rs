//! Writes one MCAP file.

use super::error::BagError;
use super::metadata::TopicMetadata;
use mcap::records::MessageHeader;
use mcap::{WriteOptions, Writer};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Seek, Write};
use std::os::unix::fs::MetadataExt;
use std::path::PathBuf;

/// The size at which a chunk is compressed and written, as in rosbag2.
const CHUNK_SIZE: usize = 768 * 1024;

/// The end of a file without an index: data end, footer, magic. These bytes follow the last chunk until the next chunk overwrites
/// them. So the file is always valid, even if this process is killed.
const END: [u8; 50] = *b"\x0f\x04\0\0\0\0\0\0\0\0\0\0\0\x02\x14\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\x89MCAP0\r\n";

/// An MCAP file that is being written.
pub(super) struct McapOutput {
    path: PathBuf,
    /// The writer of the file. The writer has no buffer: it writes whole chunks, and so reports errors at once.
    writer: Writer<File>,
    /// A second handle of the same file, to write [`END`] and to read the file's length. Both handles share the position of the
    /// next write.
    handle: File,
    /// The length of the file after the last write \[bytes\].
    size: u64,
    /// The size of the messages in the open chunk \[bytes\].
    pending: usize,
}

impl McapOutput {
    /// Creates a file, which must not exist yet.
    pub fn create(path: PathBuf) -> Result<Self, BagError> {
        let file = File::create_new(&path).map_err(BagError::write(&path))?;
        let handle = file.try_clone().map_err(BagError::write(&path))?;
        let options = WriteOptions::new()
            .profile("ros2")
            .library(concat!("dq_servo ", env!("CARGO_PKG_VERSION")))
            // This program ends chunks itself and writes them whole, so that a kill loses at most one chunk.
            .chunk_size(None)
            .disable_seeking(true)
            .compression_threads(0);
        let writer = options.create(file).map_err(BagError::write_mcap(&path))?;
        let size = handle.metadata().map_err(BagError::write(&path))?.len();
        let mut open = Self { path, writer, handle, size, pending: 0 };
        open.flush()?;
        Ok(open)
    }

    /// Adds a channel for a topic, with the type's definition and with the offered QoS as YAML.
    pub fn add(&mut self, topic: &TopicMetadata, definition: &str, qos: &str) -> Result<u16, BagError> {
        let metadata = BTreeMap::from([
            ("offered_qos_profiles".to_owned(), qos.to_owned()),
            ("topic_type_hash".to_owned(), topic.type_description_hash.clone()),
        ]);
        self.writer
            .add_schema(&topic.r#type, "ros2msg", definition.as_bytes())
            .and_then(|schema| self.writer.add_channel(schema, &topic.name, "cdr", &metadata))
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

    /// Ends the open chunk, and writes it to the file.
    ///
    /// # Errors
    /// [`BagError::Write`], also if someone has removed the file or changed its length.
    pub fn flush(&mut self) -> Result<(), BagError> {
        self.check()?;
        self.pending = 0;
        self.writer.flush().map_err(BagError::write_mcap(&self.path))?;
        self.size = self.end().map_err(BagError::write(&self.path))?;
        Ok(())
    }

    /// Writes the bytes [`END`] after the last chunk. Then moves the position back before these bytes, so that the next chunk
    /// overwrites them. Returns the length of the file.
    fn end(&mut self) -> io::Result<u64> {
        self.handle.write_all(&END)?;
        self.handle.seek_relative(-(END.len() as i64))?;
        Ok(self.handle.metadata()?.len())
    }

    /// Writes index and footer, and waits for the disk.
    ///
    /// # Errors
    /// The errors of [`flush`](Self::flush).
    pub fn close(&mut self) -> Result<(), BagError> {
        self.check()?;
        self.writer.finish().map_err(BagError::write_mcap(&self.path))?;
        self.handle.sync_all().map_err(BagError::write(&self.path))
    }

    /// Checks that the file still exists and has the expected length, to detect that another program has changed it.
    fn check(&self) -> Result<(), BagError> {
        let wrong = |why: &str| Err(BagError::Write { path: self.path.clone(), why: why.to_owned() });
        let ours = self.handle.metadata().map_err(BagError::write(&self.path))?;
        match std::fs::metadata(&self.path) {
            Ok(there) if (there.dev(), there.ino()) != (ours.dev(), ours.ino()) => {
                wrong("it was replaced while it was written")
            }
            Ok(there) if there.len() != self.size => wrong("its length was changed while it was written"),
            Ok(_) => Ok(()),
            Err(why) if why.kind() == io::ErrorKind::NotFound => wrong("it was removed while it was written"),
            Err(why) => Err(BagError::write(&self.path)(why)),
        }
    }

    /// Returns the length of the file after the last write \[bytes\].
    pub fn size(&self) -> u64 {
        self.size
    }
}
