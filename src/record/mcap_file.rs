//! Reads one MCAP file, whole, cut off or damaged, chunk by chunk.
//!
//! Opening walks along the heads of the records, which needs no index at the file's end: a recording that was killed has none.

use super::mcap_fields as fields;
use super::mcap_records::{RecordHead, Records, Step, op};
use super::message::{BagMessage, Topic};
use super::storage::{self, Block, Limit, Types, Unpacked};
use mcap::McapError;
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use std::collections::HashMap;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Messages outside of chunks are read together up to this many bytes.
const TOGETHER: u64 = 1 << 20;

/// Bytes that are asked of the file at once, however long it says a record is.
const READ_STEP: usize = 1 << 16;

/// The largest chunk that is unpacked, and with it the memory that is taken for what nobody wants \[bytes\].
const CHUNK_LIMIT: u64 = 1 << 27;

/// The longest schema or channel record that is read \[bytes\].
const DEFINITION_LIMIT: u64 = 1 << 22;

/// An MCAP file that has been looked through.
#[derive(Debug)]
pub(super) struct McapFile {
    path: PathBuf,
    pieces: Vec<Piece>,
    definitions: Definitions,
    /// How many messages the file says that it has.
    stated: Option<u64>,
}

/// A chunk, or messages one after the other.
#[derive(Clone, Copy, Debug)]
struct Piece {
    offset: u64,
    end: u64,
    start: i64,
    /// To how many bytes it unpacks, as it says.
    size: u64,
    /// Whether the channels that it defines are known.
    defined: bool,
}

/// What the messages refer to, by number.
#[derive(Clone, Debug, Default)]
struct Definitions {
    schemas: HashMap<u16, Arc<str>>,
    channels: HashMap<u16, Channel>,
}

#[derive(Clone, Debug)]
struct Channel {
    topic: Arc<str>,
    message: Arc<str>,
    /// Other encodings than CDR are another middleware's.
    is_cdr: bool,
    /// Whether a chunk has defined it, which is more to be trusted: it has a checksum, what is outside of chunks has none.
    in_chunk: bool,
    count: u64,
}

/// A message before it is known what its channel is.
struct Found {
    channel: u16,
    log_time: i64,
    cdr: Vec<u8>,
}

impl McapFile {
    /// Looks through the file; `lost` takes what of it is not whole.
    ///
    /// # Errors
    /// Where it cannot be read.
    pub fn open(path: &Path, mut lost: impl FnMut(String)) -> std::io::Result<Self> {
        let mut records = Records::new(File::open(path)?)?;
        let mut file = Self {
            path: path.to_owned(),
            pieces: Vec::new(),
            definitions: Definitions::default(),
            stated: None,
        };
        loop {
            match records.step()? {
                Step::Record(record) => file.note(&mut records, &record)?,
                Step::Gap(from, to) => {
                    lost(format!("damaged from byte {from} to {to}: what was there is lost"));
                    // Of messages that are read together, those before are whole.
                    file.pieces.retain(|piece| piece.offset < from);
                    file.pieces.iter_mut().for_each(|piece| piece.end = piece.end.min(from));
                }
                Step::End { whole: true, .. } => return Ok(file),
                Step::End { whole: false, offset } => {
                    lost(format!("cut off at byte {offset}: what is whole before is read"));
                    return Ok(file);
                }
            }
        }
    }

    /// Remembers what of a record reading needs.
    fn note(&mut self, records: &mut Records, record: &RecordHead) -> std::io::Result<()> {
        let RecordHead { opcode, offset, end } = *record;
        match opcode {
            op::CHUNK => {
                let head = records.data(record, 24)?;
                let (start, size) = (number(&head, 0), number(&head, 16).unsigned_abs());
                self.pieces.push(Piece { offset, end, start, size, defined: false });
            }
            op::MESSAGE => {
                let start = number(&records.data(record, 14)?, 6);
                match self.pieces.last_mut() {
                    Some(last) if last.end == offset && last.defined && end - last.offset <= TOGETHER => {
                        (last.end, last.start, last.size) = (end, last.start.min(start), end - last.offset);
                    }
                    // No channel is defined among messages outside of chunks.
                    _ => self.pieces.push(Piece { offset, end, start, size: end - offset, defined: true }),
                }
            }
            op::SCHEMA | op::CHANNEL => {
                // One that is damaged leaves its messages without a channel, which is reported then.
                let _ = self.definitions.take(opcode, &records.data(record, DEFINITION_LIMIT)?, false);
            }
            op::STATISTICS => self.stated = Some(number(&records.data(record, 8)?, 0).unsigned_abs()),
            _ => {}
        }
        Ok(())
    }

    /// The chunks, and messages outside of chunks some at a time.
    pub fn blocks(&self) -> Vec<Block> {
        self.pieces.iter().enumerate().map(|(number, piece)| Block { start: piece.start, number }).collect()
    }

    /// The topics of the channels that are known by now.
    pub fn topics(&self) -> Vec<Topic> {
        let channels = self.definitions.channels.values().filter(|channel| channel.is_cdr);
        channels
            .map(|channel| Topic {
                name: channel.topic.to_string(),
                message: channel.message.to_string(),
                count: channel.count,
            })
            .collect()
    }

    /// What was not found once all blocks are unpacked, or not read, a line each.
    pub fn missing(&self) -> Vec<String> {
        let channels = || self.definitions.channels.values();
        let found: u64 = channels().map(|channel| channel.count).sum();
        let stated = self.stated.filter(|stated| *stated != found);
        let other = channels().filter(|channel| !channel.is_cdr && channel.count > 0);
        let other = other.map(|Channel { topic, count, .. }| storage::of_other_encoding(topic, *count));
        stated
            .map(|stated| format!("it says that it has {stated} messages, and {found} were found"))
            .into_iter()
            .chain(other)
            .collect()
    }

    /// The messages of a piece, all or nothing, within the limit.
    pub fn load(&mut self, number: usize, types: Types, limit: Limit) -> Unpacked {
        let Some(Piece { offset, end, .. }) = self.pieces.get(number).copied() else {
            return Unpacked::default();
        };
        let content = self.unpack(number, types, limit);
        let mut unpacked = Unpacked { bytes: content.bytes, ..Unpacked::default() };
        if let Err(why) = content.end {
            unpacked.lost.push(format!("damaged from byte {offset} to {end} ({why}): its messages are lost"));
            return unpacked;
        }
        // Chunks whose time comes later, but which are earlier in the file, may have defined the channels.
        for earlier in 0..number {
            if content.counts.keys().all(|channel| self.definitions.channels.contains_key(channel)) {
                break;
            }
            if !self.pieces[earlier].defined {
                // What is wrong with it is reported when its own turn comes.
                unpacked.bytes += self.unpack(earlier, Some(&[]), limit).bytes;
            }
        }
        let strangers = self.definitions.count(&content.counts);
        if strangers > 0 {
            unpacked.lost.push(format!(
                "{strangers} messages from byte {offset} on are of channels whose definition is lost"
            ));
        }
        let wanted =
            |found| self.definitions.message(found).filter(|message| is_wanted(types, &message.message));
        unpacked.messages = content.found.into_iter().filter_map(wanted).collect();
        unpacked
    }

    /// Reads a piece once: what it defines becomes known, and of its messages those are kept that may be wanted.
    fn unpack(&mut self, number: usize, types: Types, limit: Limit) -> Content {
        let mut content = Content { found: Vec::new(), counts: HashMap::new(), bytes: 0, end: Ok(()) };
        let Content { found, counts, bytes, end } = &mut content;
        let sound = self.definitions.clone();
        let definitions = &mut self.definitions;
        let piece = &self.pieces[number];
        if piece.size > limit.work.min(CHUNK_LIMIT) {
            *end = Err("it unpacks to more than a recording of this size would".to_owned());
            return content;
        }
        let mut room = limit.room;
        *end = walk(&self.path, piece, |opcode, data| {
            *bytes += data.len() as u64;
            if opcode != op::MESSAGE {
                return definitions.take(opcode, data, true);
            }
            let (id, time, cdr) = fields::message(data).ok_or(McapError::UnexpectedEof)?;
            *counts.entry(id).or_default() += 1;
            let known = definitions.channels.get(&id);
            if known.is_none_or(|channel| channel.is_cdr && is_wanted(types, &channel.message)) {
                let too_large = McapError::ChunkTooLarge(piece.size);
                room = room.checked_sub(cdr.len() as u64).ok_or(too_large)?;
                found.push(Found { channel: id, log_time: nanoseconds(time), cdr: cdr.to_vec() });
            }
            Ok(())
        });
        if end.is_err() {
            // Its checksum comes last: what it has defined may be anything.
            self.definitions = sound;
        }
        self.pieces[number].defined = true;
        content
    }
}

/// What was in a piece.
struct Content {
    found: Vec<Found>,
    /// Messages of each channel, those that nobody wants included.
    counts: HashMap<u16, u64>,
    bytes: u64,
    end: Result<(), String>,
}

impl Definitions {
    /// A record that may define something.
    fn take(&mut self, opcode: u8, data: &[u8], in_chunk: bool) -> Result<(), McapError> {
        match opcode {
            op::SCHEMA => {
                let (id, name) = fields::schema(data).ok_or(McapError::UnexpectedEof)?;
                self.schemas.insert(id, name.into());
            }
            // Channels are repeated in chunks and at the end of the file.
            op::CHANNEL => {
                let channel = fields::channel(data).ok_or(McapError::UnexpectedEof)?;
                let known = self.channels.get(&channel.id);
                if known.is_none_or(|known| in_chunk && !known.in_chunk) {
                    let message = self.schemas.get(&channel.schema).cloned().unwrap_or_default();
                    let is_cdr = channel.encoding == "cdr";
                    let (topic, count) = (channel.topic.into(), known.map_or(0, |known| known.count));
                    self.channels.insert(channel.id, Channel { topic, message, is_cdr, in_chunk, count });
                }
            }
            // Other records define nothing.
            _ => {}
        }
        Ok(())
    }

    /// Counts messages; how many of them have no channel.
    fn count(&mut self, counts: &HashMap<u16, u64>) -> u64 {
        let mut strangers = 0;
        for (id, count) in counts {
            *self.channels.get_mut(id).map_or(&mut strangers, |channel| &mut channel.count) += count;
        }
        strangers
    }

    fn message(&self, found: Found) -> Option<BagMessage> {
        let channel = self.channels.get(&found.channel).filter(|channel| channel.is_cdr)?;
        let (topic, message) = (channel.topic.clone(), channel.message.clone());
        Some(BagMessage { topic, message, log_time: found.log_time, cdr: found.cdr })
    }
}

fn is_wanted(types: Types, message: &str) -> bool {
    types.is_none_or(|types| types.contains(&message))
}

/// Visits the records of a piece, those inside of its chunk one by one as they are unpacked, to no more bytes than it says.
fn walk(
    path: &Path,
    piece: &Piece,
    mut visit: impl FnMut(u8, &[u8]) -> Result<(), McapError>,
) -> Result<(), String> {
    let open = || {
        let mut file = File::open(path)?;
        file.seek(SeekFrom::Start(piece.offset))?;
        Ok(file.take(piece.end - piece.offset))
    };
    let mut input = open().map_err(|why: std::io::Error| why.to_string())?;
    let options = LinearReaderOptions::default()
        .with_skip_start_magic(true)
        .with_skip_end_magic(true)
        .with_validate_chunk_crcs(true)
        .with_record_length_limit(usize::try_from(piece.size).unwrap_or(usize::MAX));
    let mut reader = LinearReader::new_with_options(options);
    let mut unpacked = 0;
    while let Some(event) = reader.next_event() {
        match event.map_err(|why| why.to_string())? {
            LinearReadEvent::ReadRequest(bytes) => {
                let read = input.read(reader.insert(bytes.min(READ_STEP))).map_err(|why| why.to_string())?;
                reader.notify_read(read);
            }
            LinearReadEvent::Record { data, opcode } => {
                unpacked += data.len() as u64;
                if unpacked > piece.size {
                    return Err("it unpacks to more bytes than it says".to_owned());
                }
                visit(opcode, data).map_err(|why| why.to_string())?;
            }
        }
    }
    Ok(())
}

/// The number \[ns\] there, or the least where there is none.
fn number(data: &[u8], at: usize) -> i64 {
    let bytes = data.get(at..at + 8).and_then(|bytes| bytes.try_into().ok());
    nanoseconds(bytes.map_or(0, u64::from_le_bytes))
}

/// MCAP's times are unsigned; those after the year 2262 saturate.
fn nanoseconds(time: u64) -> i64 {
    i64::try_from(time).unwrap_or(i64::MAX)
}
