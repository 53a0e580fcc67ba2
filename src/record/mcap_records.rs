//! Walks along the records of an MCAP file by their heads, past damage too. What is inside of chunks stays packed.

use std::fs::File;
use std::io::{BufReader, Read, Result, Seek, SeekFrom};

/// Opcode and length before every record.
const HEAD: u64 = 9;

/// Bytes of a chunk record before its messages, the name of its compression not counted: times, size, checksum, two lengths.
const CHUNK_HEAD: u64 = 8 + 8 + 8 + 4 + 4 + 8;

/// Bytes of a footer record.
const FOOTER_LENGTH: u64 = 20;

/// Bytes of a message record before its payload.
const MESSAGE_HEAD: u64 = 22;

/// Opcodes of the MCAP specification.
pub(super) mod op {
    pub const FOOTER: u8 = 0x02;
    pub const SCHEMA: u8 = 0x03;
    pub const CHANNEL: u8 = 0x04;
    pub const MESSAGE: u8 = 0x05;
    pub const CHUNK: u8 = 0x06;
    pub const STATISTICS: u8 = 0x0b;
    pub const LAST: u8 = 0x0f;
    /// From here on records are an application's own.
    pub const FIRST_PRIVATE: u8 = 0x80;
}

/// One record of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct RecordHead {
    pub opcode: u8,
    /// Where it begins, head included.
    pub offset: u64,
    /// Where the next one begins.
    pub end: u64,
}

/// What comes next in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Step {
    Record(RecordHead),
    /// No record is between these two places, though one was to be at the first.
    Gap(u64, u64),
    /// The file ends at its footer, or before it.
    End {
        whole: bool,
        offset: u64,
    },
}

/// An MCAP file that is walked along.
pub(super) struct Records {
    file: BufReader<File>,
    length: u64,
    /// The record before, from which on to look where the next place has no record: its length may be what is wrong.
    last: u64,
    next: u64,
}

impl Records {
    /// From the first record on.
    pub fn new(file: File) -> Result<Self> {
        let length = file.metadata()?.len();
        let start = mcap::MAGIC.len() as u64;
        Ok(Self { file: BufReader::new(file), length, last: start, next: start })
    }

    /// Goes on to the next record.
    pub fn step(&mut self) -> Result<Step> {
        let at = self.next;
        if let Some(record) = self.record_at(at)? {
            (self.last, self.next) = (at, record.end);
            if record.opcode != op::FOOTER {
                return Ok(Step::Record(record));
            }
            let mut magic = Vec::new();
            self.seek(record.end)?;
            self.file.by_ref().take(mcap::MAGIC.len() as u64).read_to_end(&mut magic)?;
            return Ok(Step::End { whole: magic == mcap::MAGIC, offset: record.end });
        }
        match self.search(self.last + 1)? {
            // The record before was shorter than it said, or damaged bytes follow it.
            Some(found) => {
                let gap = if found < at { self.last } else { at };
                (self.last, self.next) = (found, found);
                Ok(Step::Gap(gap, found))
            }
            None => Ok(Step::End { whole: false, offset: at }),
        }
    }

    /// The bytes of a record without its head, `limit` at most.
    pub fn data(&mut self, record: &RecordHead, limit: u64) -> Result<Vec<u8>> {
        self.seek(record.offset + HEAD)?;
        let mut data = Vec::new();
        let length = (record.end - record.offset - HEAD).min(limit);
        self.file.by_ref().take(length).read_to_end(&mut data)?;
        Ok(data)
    }

    fn seek(&mut self, to: u64) -> Result<()> {
        let from = self.file.stream_position()?;
        match i64::try_from(i128::from(to) - i128::from(from)) {
            Ok(way) => self.file.seek_relative(way),
            Err(_) => self.file.seek(SeekFrom::Start(to)).map(drop),
        }
    }

    /// The record that begins there, if one can.
    fn record_at(&mut self, offset: u64) -> Result<Option<RecordHead>> {
        if self.length.saturating_sub(offset) < HEAD {
            return Ok(None);
        }
        self.seek(offset)?;
        let mut head = [0; HEAD as usize];
        self.file.read_exact(&mut head)?;
        let [opcode, length @ ..] = head;
        let length = u64::from_le_bytes(length);
        let end = length.checked_add(offset + HEAD).filter(|end| *end <= self.length);
        let known = match opcode {
            op::FOOTER => length == FOOTER_LENGTH,
            op::MESSAGE => length >= MESSAGE_HEAD,
            _ => (1..=op::LAST).contains(&opcode) || opcode >= op::FIRST_PRIVATE,
        };
        let Some(end) = end.filter(|_| known) else { return Ok(None) };
        let record = RecordHead { opcode, offset, end };
        let fits = opcode != op::CHUNK || self.chunk_fits(&record)?;
        Ok(fits.then_some(record))
    }

    /// Whether a chunk is as long as it says inside.
    fn chunk_fits(&mut self, record: &RecordHead) -> Result<bool> {
        let start = self.data(record, CHUNK_HEAD + 16)?;
        let number = |at: usize| Some(u32::from_le_bytes(start.get(at..at + 4)?.try_into().ok()?));
        let inside = || {
            let name = usize::try_from(number(28)?).ok().filter(|length| *length <= 16)?;
            let (low, high) = (number(32 + name)?, number(36 + name)?);
            Some(CHUNK_HEAD + name as u64 + (u64::from(high) << 32 | u64::from(low)))
        };
        Ok(inside().is_some_and(|length| length == record.end - record.offset - HEAD))
    }

    /// The next place from `from` on at which a chunk or message begins that two more records follow, or the end.
    fn search(&mut self, from: u64) -> Result<Option<u64>> {
        const WINDOW: u64 = 1 << 16;
        let mut start = from;
        while start < self.length {
            self.seek(start)?;
            let mut window = Vec::new();
            self.file.by_ref().take(WINDOW + HEAD).read_to_end(&mut window)?;
            let left = self.length - start;
            let may_begin = |at: &usize| match window.get(*at..*at + HEAD as usize) {
                Some(&[opcode, b0, b1, b2, b3, b4, b5, b6, b7]) => {
                    matches!(opcode, op::MESSAGE | op::CHUNK)
                        && u64::from_le_bytes([b0, b1, b2, b3, b4, b5, b6, b7]) <= left
                }
                _ => false,
            };
            let places: Vec<_> = (0..window.len().min(WINDOW as usize)).filter(may_begin).collect();
            for place in places {
                if self.records_follow(start + place as u64)? {
                    return Ok(Some(start + place as u64));
                }
            }
            start += WINDOW;
        }
        Ok(None)
    }

    fn records_follow(&mut self, mut offset: u64) -> Result<bool> {
        for _ in 0..3 {
            match self.record_at(offset)? {
                Some(RecordHead { opcode: op::FOOTER, .. }) => return Ok(true),
                Some(record) => offset = record.end,
                None => return Ok(false),
            }
        }
        Ok(true)
    }
}
