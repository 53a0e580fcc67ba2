//! Reads one MCAP file, whole or cut off, chunk by chunk.
//!
//! The summary at the file's end is not used: a recording that was killed has none. Opening reads the file once from
//! its start, which finds every whole chunk, checks it, and counts its messages.

use super::error::BagError;
use super::mcap_records::{RECORD_HEAD, Stop, op, walk_file, walk_records};
use super::reader::{BagMessage, Block, Contents, Place, Topic};
use mcap::McapError;
use mcap::records::Record;
use std::collections::HashMap;
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// An MCAP file that has been looked through.
#[derive(Debug)]
pub(super) struct McapFile {
    path: PathBuf,
    channels: HashMap<u16, Channel>,
    /// Where its messages are.
    blocks: Vec<Block>,
}

#[derive(Debug)]
struct Channel {
    topic: Arc<str>,
    message: Arc<str>,
    /// Other encodings than CDR are another middleware's.
    is_cdr: bool,
    count: u64,
}

impl McapFile {
    /// Looks through the file.
    ///
    /// # Errors
    /// [`BagError::Read`], [`BagError::NotABag`], [`BagError::Damaged`].
    pub fn open(path: &Path) -> Result<Contents<Self>, BagError> {
        let input = File::open(path).map_err(BagError::read(path))?;
        let mut scan = Scan::default();
        let end = walk_file(BufReader::new(input), |opcode, data| scan.take(opcode, data));
        let truncated = match end {
            Ok(()) => false,
            // The file stops within a record, or before its footer.
            Err(Stop::Mcap(McapError::UnexpectedEof)) => true,
            // Zeros: a file system that had no time to write what it had promised room for.
            Err(Stop::Zeros) => true,
            Err(stop) => return Err(stop.told(path, scan.offset())),
        };
        let Scan { schemas: _, channels, blocks, .. } = scan;
        if !channels.is_empty() && channels.values().all(|channel| !channel.is_cdr) {
            return Err(BagError::not_a_bag(path, "none of its channels carries CDR messages"));
        }
        let topics = channels.values().filter(|channel| channel.is_cdr).map(Channel::topic).collect();
        Ok(Contents { file: Self { path: path.to_owned(), channels, blocks }, topics, truncated })
    }

    /// Where its messages are.
    pub fn blocks(&self) -> &[Block] {
        &self.blocks
    }

    /// The messages of the record at `offset`, head included `length` bytes long.
    ///
    /// # Errors
    /// [`BagError::Read`], [`BagError::Damaged`].
    pub fn load(&self, offset: u64, length: u64) -> Result<Vec<BagMessage>, BagError> {
        let mut input = File::open(&self.path).map_err(BagError::read(&self.path))?;
        input.seek(SeekFrom::Start(offset)).map_err(BagError::read(&self.path))?;
        let mut messages = Vec::new();
        let take = |opcode: u8, data: &[u8]| {
            if opcode == op::MESSAGE {
                messages.extend(self.message(data)?);
            }
            Ok(())
        };
        walk_records(input.take(length), take).map_err(|stop| stop.told(&self.path, offset))?;
        Ok(messages)
    }

    /// The message, unless its channel is not CDR.
    fn message(&self, data: &[u8]) -> Result<Option<BagMessage>, Stop> {
        let Record::Message { header, data } = mcap::parse_record(op::MESSAGE, data)? else {
            return Ok(None);
        };
        let channel = self.channels.get(&header.channel_id).filter(|channel| channel.is_cdr);
        Ok(channel.map(|channel| BagMessage {
            topic: channel.topic.clone(),
            message: channel.message.clone(),
            log_time: nanoseconds(header.log_time),
            cdr: data.into_owned(),
        }))
    }
}

impl Channel {
    fn topic(&self) -> Topic {
        Topic { name: self.topic.to_string(), message: self.message.to_string(), count: self.count }
    }
}

/// What opening has found so far.
#[derive(Default)]
struct Scan {
    /// Names by id.
    schemas: HashMap<u16, Arc<str>>,
    channels: HashMap<u16, Channel>,
    blocks: Vec<Block>,
    /// Bytes of records before the one that is looked at.
    position: u64,
}

impl Scan {
    /// Where the record is that is looked at.
    fn offset(&self) -> u64 {
        mcap::MAGIC.len() as u64 + self.position
    }

    fn take(&mut self, opcode: u8, data: &[u8]) -> Result<(), Stop> {
        let length = (RECORD_HEAD + data.len()) as u64;
        let offset = self.offset();
        match opcode {
            0 => return Err(Stop::Zeros),
            op::CHUNK => {
                let mut start = None;
                let head = (data.len() as u64).to_le_bytes();
                let record = [op::CHUNK].into_iter().chain(head).collect::<Vec<_>>();
                let visit = |opcode: u8, data: &[u8]| self.take_one(opcode, data, &mut start);
                walk_records((&record[..]).chain(data), visit).map_err(Stop::within_chunk)?;
                self.blocks
                    .extend(start.map(|start| Block { start, place: Place::Record { offset, length } }));
            }
            _ => {
                let mut start = None;
                self.take_one(opcode, data, &mut start)?;
                self.blocks
                    .extend(start.map(|start| Block { start, place: Place::Record { offset, length } }));
            }
        }
        self.position += length;
        Ok(())
    }

    /// A record inside or outside of a chunk. `start` becomes the first log time \[ns\] of the block's messages.
    fn take_one(&mut self, opcode: u8, data: &[u8], start: &mut Option<i64>) -> Result<(), Stop> {
        // Other records are passed over unparsed.
        if ![op::SCHEMA, op::CHANNEL, op::MESSAGE].contains(&opcode) {
            return Ok(());
        }
        match mcap::parse_record(opcode, data)? {
            Record::Schema { header, .. } => {
                self.schemas.insert(header.id, header.name.into());
            }
            Record::Channel(channel) => self.add_channel(channel),
            Record::Message { header, .. } => {
                let time = nanoseconds(header.log_time);
                let channel = self.channels.get_mut(&header.channel_id);
                channel
                    .ok_or_else(|| {
                        Stop::Content(format!("a message of the unknown channel {}", header.channel_id))
                    })?
                    .count += 1;
                *start = Some(start.map_or(time, |start| start.min(time)));
            }
            _ => {}
        }
        Ok(())
    }

    /// Channels are repeated at the end of the file, and in chunks.
    fn add_channel(&mut self, channel: mcap::records::Channel) {
        let message = self.schemas.get(&channel.schema_id).cloned().unwrap_or_default();
        self.channels.entry(channel.id).or_insert_with(|| Channel {
            topic: channel.topic.into(),
            message,
            is_cdr: channel.message_encoding == "cdr",
            count: 0,
        });
    }
}

/// MCAP's times are unsigned; those after the year 2262 saturate.
fn nanoseconds(time: u64) -> i64 {
    i64::try_from(time).unwrap_or(i64::MAX)
}
