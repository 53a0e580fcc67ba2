//! Unpacks rosbag2's own zstd compression of whole files (`compression_mode: FILE`) or of single messages (`MESSAGE`).

use super::block::Unpacked;
use super::error::BagError;
use super::unreadable::UnreadableParts;
use std::fs::File;
use std::io::{Read, copy};
use std::path::Path;
use tempfile::NamedTempFile;

/// The beginning of every zstd frame. No other content begins like this: CDR begins with a zero, and MCAP and SQLite have other
/// beginnings.
const MAGIC: [u8; 4] = [0x28, 0xb5, 0x2f, 0xfd];

/// Returns whether a zstd frame begins with these bytes.
pub(super) fn is_packed(bytes: &[u8]) -> bool {
    bytes.starts_with(&MAGIC)
}

/// Unpacks a file into a temporary file, up to the first damage and up to `limit` bytes.
///
/// # Errors
/// [`BagError::Read`], [`BagError::Write`].
pub(super) fn unpack_file(
    path: &Path,
    limit: u64,
    losses: &mut UnreadableParts,
) -> Result<NamedTempFile, BagError> {
    let input = File::open(path).and_then(zstd::Decoder::new).map_err(BagError::read(path))?;
    let mut output = NamedTempFile::new().map_err(BagError::write(&std::env::temp_dir()))?;
    // Allow one byte more than the limit. If that byte exists, the file is too long.
    match copy(&mut input.take(limit + 1), &mut output) {
        Ok(bytes) if bytes > limit => {
            losses.add(path, format!("it unpacks to more than {limit} bytes: the rest is skipped"))
        }
        Ok(_) => {}
        Err(why) => {
            losses.add(path, format!("it cannot be unpacked to its end ({why}): what was unpacked is read"))
        }
    }
    Ok(output)
}

/// Unpacks those messages that are compressed, in place. Stops after `limit` bytes in total.
pub(super) fn unpack_messages(unpacked: &mut Unpacked, limit: u64) {
    let Unpacked { messages, bytes, lost } = unpacked;
    let mut damaged = 0;
    messages.retain_mut(|message| {
        if !is_packed(&message.cdr) {
            return true;
        }
        let mut cdr = Vec::new();
        let room = limit.saturating_sub(*bytes);
        let read =
            zstd::Decoder::new(&message.cdr[..]).and_then(|input| input.take(room + 1).read_to_end(&mut cdr));
        let is_whole = read.is_ok_and(|length| length as u64 <= room);
        *bytes += cdr.len() as u64;
        message.cdr = cdr;
        damaged += u64::from(!is_whole);
        is_whole
    });
    if damaged > 0 {
        lost.push(format!("{damaged} compressed messages cannot be unpacked"));
    }
}
