//! Reads one MCAP file chunk by chunk, up to its end or to the first damage.
//!
//! Opening reads the whole file once, because a killed recording has no index. Opening also checks that the parts are complete and
//! that their checksums are valid.

use super::block::{Block, Limit, Types, Unpacked, of_other_encoding};
use super::format::Format;
use super::mcap_fields as fields;
use super::message::{BagMessage, Topic};
use mcap::records::op;
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use std::collections::HashMap;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Consecutive messages outside of chunks are read together, up to this number of bytes.
const TOGETHER: u64 = 1 << 20;

/// The largest number of bytes that are read at once, even if a record states a greater length.
const READ_STEP: usize = 1 << 16;

/// The limit for the size of a record, and for the unpacked size of a chunk \[bytes\]. Larger records and chunks count as damaged.
const RECORD_LIMIT: u64 = 1 << 27;

/// The size of the header of each record: its opcode (1) and its length (8) \[bytes\].
const HEAD: u64 = 9;

/// An MCAP file, with the chunks and messages ([`Piece`]), schemas and channels that [`open`](Self::open) found in it.
#[derive(Debug)]
pub(super) struct McapFile {
    path: PathBuf,
    pieces: Vec<Piece>,
    schemas: HashMap<u16, Arc<str>>,
    channels: HashMap<u16, Channel>,
}

/// A chunk, or consecutive messages outside of chunks.
#[derive(Clone, Debug)]
struct Piece {
    /// The range of the piece in the file.
    place: Range<u64>,
    /// The earliest log time of a message in the piece \[ns\].
    start: i64,
    /// The unpacked size of the piece \[bytes\].
    size: u64,
}

#[derive(Clone, Debug)]
struct Channel {
    topic: Arc<str>,
    message: Arc<str>,
    /// Whether the encoding is CDR. Other middleware has other encodings.
    is_cdr: bool,
    /// The number of the channel's messages that were loaded.
    count: u64,
}

impl McapFile {
    /// Reads the file, and checks its chunks. If the chunks read so far unpack to more bytes than `limit` allows, the file counts as
    /// damaged. Calls `lost` with a line about the first damage, or about missing messages.
    ///
    /// # Errors
    /// The operating system's error if the file cannot be opened.
    pub fn open(path: &Path, limit: Limit, mut lost: impl FnMut(String)) -> std::io::Result<Self> {
        let file = File::open(path)?;
        let (pieces, schemas, channels) = (Vec::new(), HashMap::new(), HashMap::new());
        let mut this = Self { path: path.to_owned(), pieces, schemas, channels };
        let (mut end, mut work, mut messages, mut stated) = (mcap::MAGIC.len() as u64, limit.work, 0, None);
        let options = LinearReaderOptions::default().with_emit_chunks(true);
        let read = records(file, options, RECORD_LIMIT, |opcode, data| {
            let place = end..end + HEAD + data.len() as u64;
            if opcode == op::CHUNK {
                let (piece, count) = this.scan_chunk(place.clone(), data, work)?;
                (work, messages) = (work - piece.size, messages + count);
                this.pieces.push(piece);
            } else if let Some(time) = this.define(opcode, data)? {
                this.add(place.clone(), time);
                messages += 1;
            } else if opcode == op::STATISTICS {
                stated = fields::message_count(data);
            }
            end = place.end;
            Ok(())
        });
        if let Err(why) = read {
            let before = format!("the {messages} messages before are read");
            lost(format!("damaged or cut off at byte {end} ({why}): {before}, `mcap recover` may save more"));
        } else if let Some(stated) = stated.filter(|stated| *stated != messages) {
            lost(format!("it says that it has {stated} messages, and {messages} were found"));
        }
        Ok(this)
    }

    /// Checks each record of a chunk, which may unpack to at most `work` bytes. Returns the chunk as a [`Piece`], and the number of
    /// its messages. If the chunk is damaged, discards the schemas and channels that it defines.
    fn scan_chunk(&mut self, place: Range<u64>, data: &[u8], work: u64) -> Result<(Piece, u64), String> {
        let size = fields::chunk_size(data).ok_or("a chunk that is not as long as it says")?;
        if size > work.min(RECORD_LIMIT) {
            return Err("it unpacks to more than a recording of its size would".to_owned());
        }
        let (schemas, channels) = (self.schemas.clone(), self.channels.clone());
        let (mut piece, mut count) = (Piece { place, start: i64::MAX, size }, 0);
        let [head, length] = [&[op::CHUNK][..], &(data.len() as u64).to_le_bytes()];
        let looked = records(head.chain(length).chain(data), part_of_a_file(), size, |opcode, data| {
            if let Some(time) = self.define(opcode, data)? {
                (piece.start, count) = (piece.start.min(time), count + 1);
            }
            Ok(())
        });
        if looked.is_err() {
            (self.schemas, self.channels) = (schemas, channels);
        }
        looked.map(|()| (piece, count))
    }

    /// Adds a message outside of chunks.
    fn add(&mut self, place: Range<u64>, time: i64) {
        let size = place.end - place.start;
        match self.pieces.last_mut() {
            Some(last) if last.place.end == place.start && last.size + size <= TOGETHER => {
                (last.place.end, last.start, last.size) = (place.end, last.start.min(time), last.size + size);
            }
            _ => self.pieces.push(Piece { place, start: time, size }),
        }
    }

    /// Stores the schema or channel that a record defines. If the record is a message, returns its log time \[ns\]; otherwise
    /// `None`.
    fn define(&mut self, opcode: u8, data: &[u8]) -> Result<Option<i64>, String> {
        match opcode {
            op::SCHEMA => {
                let (id, name) = fields::schema(data).ok_or("a schema without a name")?;
                self.schemas.entry(id).or_insert_with(|| name.into());
            }
            // The first definition of a channel counts. Later ones may be damaged, because the end of a file repeats the channels
            // without a checksum.
            op::CHANNEL => {
                let channel = fields::channel(data).ok_or("a channel without a topic")?;
                let message = self.schemas.get(&channel.schema).cloned().unwrap_or_default();
                let (topic, is_cdr) = (channel.topic.into(), channel.encoding == "cdr");
                self.channels.entry(channel.id).or_insert(Channel { topic, message, is_cdr, count: 0 });
            }
            op::MESSAGE => {
                let (id, time, _) = fields::message(data).ok_or("a message without a time")?;
                if !self.channels.contains_key(&id) {
                    return Err("a message of a channel that nothing defines".to_owned());
                }
                return Ok(Some(nanoseconds(time)));
            }
            // Other records define nothing.
            _ => {}
        }
        Ok(None)
    }
}

impl Format for McapFile {
    fn blocks(&self) -> Vec<Block> {
        self.pieces.iter().enumerate().map(|(number, piece)| Block { start: piece.start, number }).collect()
    }

    fn topics(&self) -> Vec<Topic> {
        let channels = self.channels.values().filter(|channel| channel.is_cdr);
        channels
            .map(|channel| Topic {
                name: channel.topic.to_string(),
                message: channel.message.to_string(),
                count: channel.count,
            })
            .collect()
    }

    fn missing(&self) -> Vec<String> {
        let other = self.channels.values().filter(|channel| !channel.is_cdr && channel.count > 0);
        other.map(|channel| of_other_encoding(&channel.topic, channel.count)).collect()
    }

    fn load(&mut self, number: usize, types: &Types, room: u64) -> Unpacked {
        let mut unpacked = Unpacked::default();
        let Some(Piece { place, size, .. }) = self.pieces.get(number) else { return unpacked };
        let file = || {
            let mut file = File::open(&self.path)?;
            file.seek(SeekFrom::Start(place.start))?;
            Ok(file.take(place.end - place.start))
        };
        let (channels, Unpacked { messages, bytes, .. }) = (&mut self.channels, &mut unpacked);
        let read = file().map_err(|why: std::io::Error| why.to_string()).and_then(|file| {
            records(file, part_of_a_file(), *size, |opcode, data| {
                let message = fields::message(data).filter(|_| opcode == op::MESSAGE);
                let Some((id, time, cdr)) = message else { return Ok(()) };
                let Some(channel) = channels.get_mut(&id) else { return Ok(()) };
                let Channel { topic, message, is_cdr, count } = channel;
                let wanted = *is_cdr
                    && types.as_ref().is_none_or(|types| types.iter().any(|name| **name == **message));
                if wanted {
                    *bytes += cdr.len() as u64;
                    if *bytes > room {
                        return Err("it unpacks to more than a recording of its size would".to_owned());
                    }
                    let (topic, message) = (topic.clone(), message.clone());
                    let log_time = nanoseconds(time);
                    messages.push(BagMessage { topic, message, log_time, cdr: cdr.to_vec() });
                }
                *count += 1;
                Ok(())
            })
        });
        if let Err(why) = read {
            unpacked.lost.push(format!("bytes {place:?} cannot be read any more ({why})"));
        }
        unpacked
    }
}

/// Returns the options for records in the middle of a file.
fn part_of_a_file() -> LinearReaderOptions {
    LinearReaderOptions::default().with_skip_start_magic(true).with_skip_end_magic(true)
}

/// Visits all records, including those in chunks. A chunk may unpack to at most `limit` bytes.
fn records(
    mut input: impl Read,
    options: LinearReaderOptions,
    limit: u64,
    mut visit: impl FnMut(u8, &[u8]) -> Result<(), String>,
) -> Result<(), String> {
    let limit = usize::try_from(limit).unwrap_or(usize::MAX).max(READ_STEP);
    let options = options.with_validate_chunk_crcs(true).with_record_length_limit(limit);
    let mut reader = LinearReader::new_with_options(options);
    while let Some(event) = reader.next_event() {
        match event.map_err(|why| why.to_string())? {
            LinearReadEvent::ReadRequest(bytes) => {
                let read = input.read(reader.insert(bytes.min(READ_STEP))).map_err(|why| why.to_string())?;
                reader.notify_read(read);
            }
            LinearReadEvent::Record { data, opcode } => visit(opcode, data)?,
        }
    }
    Ok(())
}

/// Converts MCAP's unsigned times. A time after the year 2262 saturates.
fn nanoseconds(time: u64) -> i64 {
    i64::try_from(time).unwrap_or(i64::MAX)
}
