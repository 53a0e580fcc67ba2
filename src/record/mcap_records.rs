//! Walks through the records of MCAP files, within bounds whatever the files say.

use super::error::BagError;
use mcap::McapError;
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use std::io::Read;
use std::path::Path;

/// The largest record, and the largest chunk once it is unpacked, that is read: what a file says of its sizes is
/// not trusted with the memory.
const SIZE_LIMIT: usize = 128 * 1024 * 1024;

/// Bytes that are asked of the file at once, however long it says a record is.
const READ_STEP: usize = 1024 * 1024;

/// Opcode and length before every record.
pub(super) const RECORD_HEAD: usize = 9;

/// Opcodes of the MCAP specification.
pub(super) mod op {
    pub const SCHEMA: u8 = 0x03;
    pub const CHANNEL: u8 = 0x04;
    pub const MESSAGE: u8 = 0x05;
    pub const CHUNK: u8 = 0x06;
}

/// Why a walk through records ended early.
pub(super) enum Stop {
    /// Bytes are no MCAP records.
    Mcap(McapError),
    /// The file cannot be read.
    Read(std::io::Error),
    /// Records contradict each other.
    Content(String),
    /// No record begins with zero: a file system had no time to write what it had promised room for.
    Zeros,
}

impl From<McapError> for Stop {
    fn from(error: McapError) -> Self {
        Self::Mcap(error)
    }
}

/// Visits the records of a piece of a file, those inside of chunks one by one.
pub(super) fn walk_records(
    input: impl Read,
    mut visit: impl FnMut(u8, &[u8]) -> Result<(), Stop>,
) -> Result<(), Stop> {
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

/// Visits the records of a whole file, its chunks unopened.
pub(super) fn walk_file(
    input: impl Read,
    visit: impl FnMut(u8, &[u8]) -> Result<(), Stop>,
) -> Result<(), Stop> {
    walk(input, LinearReaderOptions::default().with_emit_chunks(true), visit)
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
    pub fn within_chunk(self) -> Self {
        match self {
            Self::Mcap(why) => Self::Content(format!("in a chunk: {why}")),
            other => other,
        }
    }

    pub fn told(self, path: &Path, offset: u64) -> BagError {
        match self {
            Self::Read(why) => BagError::read(path)(why),
            Self::Mcap(why) => BagError::damaged(path, format!("at byte {offset}: {why}")),
            Self::Content(why) => BagError::damaged(path, format!("at byte {offset}: {why}")),
            Self::Zeros => BagError::damaged(path, format!("at byte {offset}: zeros")),
        }
    }
}
