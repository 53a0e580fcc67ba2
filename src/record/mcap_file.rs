//! Reads one MCAP file, whole or cut off, chunk by chunk.
//!
//! The summary at the file's end is not used: a recording that was killed has none. Opening reads the file once from
//! its start, which finds every whole chunk, checks it, and counts its messages.

use super::error::BagError;
use super::reader::{BagMessage, Block, Contents, Place, Topic};
use mcap::McapError;
use mcap::records::Record;
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use std::collections::HashMap;
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The largest record, and the largest chunk once it is unpacked, that is read: what a file says of its sizes is
/// not trusted with the memory.
const SIZE_LIMIT: usize = 128 * 1024 * 1024;

/// Bytes that are asked of the file at once, however long it says a record is.
const READ_STEP: usize = 1024 * 1024;

/// Opcode and length before every record.
const RECORD_HEAD: usize = 9;

/// Opcodes of the MCAP specification.
mod op {
    pub const SCHEMA: u8 = 0x03;
    pub const CHANNEL: u8 = 0x04;
    pub const MESSAGE: u8 = 0x05;
    pub const CHUNK: u8 = 0x06;
}

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

/// Why a walk through records ended early.
enum Stop {
    Mcap(McapError),
    Read(std::io::Error),
    Content(String),
}

impl From<McapError> for Stop {
    fn from(error: McapError) -> Self {
        Self::Mcap(error)
    }
}

impl McapFile {
    /// Looks through the file.
    ///
    /// # Errors
    /// [`BagError::Read`], [`BagError::NotABag`], [`BagError::Damaged`].
    pub fn open(path: &Path) -> Result<Contents<Self>, BagError> {
        let input = File::open(path).map_err(BagError::read(path))?;
        let mut scan = Scan::default();
        // Chunks are taken as a whole here, to know where each begins.
        let options = LinearReaderOptions::default().with_emit_chunks(true);
        let end = walk(BufReader::new(input), options, |opcode, data| scan.take(opcode, data));
        let truncated = match end {
            Ok(()) => false,
            // The file stops within a record, or before its footer.
            Err(Stop::Mcap(McapError::UnexpectedEof)) => true,
            // Zeros: a file system that had no time to write what it had promised room for.
            Err(Stop::Content(ref why)) if why == NO_RECORD => true,
            Err(stop) => return Err(stop.told(path, scan.position)),
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

/// No record has opcode 0.
const NO_RECORD: &str = "no record";

impl Scan {
    fn take(&mut self, opcode: u8, data: &[u8]) -> Result<(), Stop> {
        let length = (RECORD_HEAD + data.len()) as u64;
        let offset = mcap::MAGIC.len() as u64 + self.position;
        match opcode {
            0 => return Err(Stop::Content(NO_RECORD.to_owned())),
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

/// Visits the records of a piece of a file, those inside of chunks one by one.
fn walk_records(input: impl Read, mut visit: impl FnMut(u8, &[u8]) -> Result<(), Stop>) -> Result<(), Stop> {
    let options = LinearReaderOptions::default()
        .with_skip_start_magic(true)
        .with_skip_end_magic(true)
        .with_prevalidate_chunk_crcs(true);
    let mut unpacked = 0;
    walk(input, options, |opcode, data| {
        // A chunk without a checksum is unpacked in steps: here is the limit to all of them.
        unpacked += RECORD_HEAD + data.len();
        if unpacked > SIZE_LIMIT {
            return Err(Stop::Content(format!("a chunk of more than {SIZE_LIMIT} bytes")));
        }
        visit(opcode, data)
    })
}

/// Visits every record.
fn walk(
    mut input: impl Read,
    options: LinearReaderOptions,
    mut visit: impl FnMut(u8, &[u8]) -> Result<(), Stop>,
) -> Result<(), Stop> {
    let mut reader = LinearReader::new_with_options(options.with_record_length_limit(SIZE_LIMIT));
    while let Some(event) = reader.next_event() {
        match event? {
            LinearReadEvent::ReadRequest(bytes) => {
                let read = input.read(reader.insert(bytes.min(READ_STEP))).map_err(Stop::Read)?;
                reader.notify_read(read);
            }
            LinearReadEvent::Record { data, opcode } => visit(opcode, data)?,
        }
    }
    Ok(())
}

impl Stop {
    /// Where a chunk's content ends early, the file does not: it is damaged, not cut off.
    fn within_chunk(self) -> Self {
        match self {
            Self::Mcap(why) => Self::Content(format!("in a chunk: {why}")),
            other => other,
        }
    }

    fn told(self, path: &Path, offset: u64) -> BagError {
        match self {
            Self::Read(why) => BagError::read(path)(why),
            Self::Mcap(McapError::BadMagic) if offset == 0 => BagError::not_a_bag(path, "it is no MCAP file"),
            Self::Mcap(why) => BagError::damaged(path, format!("at byte {offset}: {why}")),
            Self::Content(why) => BagError::damaged(path, format!("at byte {offset}: {why}")),
        }
    }
}

/// MCAP's times are unsigned; those after the year 2262 saturate.
fn nanoseconds(time: u64) -> i64 {
    i64::try_from(time).unwrap_or(i64::MAX)
}
