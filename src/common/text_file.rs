//! Text files that a user names on a command line or in a parameter.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// Returns the content of a regular file of at most `most` bytes. Does not open other kinds of files: reading a FIFO may block
/// forever, and a device may never end.
///
/// # Errors
/// Returns the operating system's error, or an error that says what is wrong with the file.
pub fn bytes(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    if !std::fs::metadata(path)?.is_file() {
        return Err(io::Error::other("it is not a regular file"));
    }
    let mut bytes = Vec::new();
    File::open(path)?.take(most + 1).read_to_end(&mut bytes)?;
    match bytes.len() as u64 > most {
        true => Err(io::Error::other(format!("it is longer than {most} bytes"))),
        false => Ok(bytes),
    }
}

/// Returns the text of a regular file of at most `most` bytes.
///
/// # Errors
/// Returns the errors of [`bytes`], and an error if the content is not UTF-8.
pub fn read(path: &Path, most: u64) -> io::Result<String> {
    let no_text = |_| io::Error::new(io::ErrorKind::InvalidData, "it is not UTF-8 text");
    String::from_utf8(bytes(path, most)?).map_err(no_text)
}
