//! Text files that somebody names on a command line or in a parameter.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// What is in a regular file of at most that many bytes. Others are not opened: a FIFO may wait for ever, and a device may never end.
///
/// # Errors
/// The operating system's, and what is wrong with the file in words.
pub fn bytes(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    if !std::fs::metadata(path)?.is_file() {
        return Err(io::Error::other("it is no regular file"));
    }
    let mut bytes = Vec::new();
    File::open(path)?.take(most + 1).read_to_end(&mut bytes)?;
    match bytes.len() as u64 > most {
        true => Err(io::Error::other(format!("it is longer than {most} bytes"))),
        false => Ok(bytes),
    }
}

/// The text of such a file.
///
/// # Errors
/// The same, and that it is no UTF-8.
pub fn read(path: &Path, most: u64) -> io::Result<String> {
    let no_text = |_| io::Error::new(io::ErrorKind::InvalidData, "it is no UTF-8 text");
    String::from_utf8(bytes(path, most)?).map_err(no_text)
}
