//! Text files that somebody names on a command line or in a parameter.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// The text of a regular file of at most that many bytes. Others are not opened: a FIFO may wait for ever, and a device may never end.
///
/// # Errors
/// The operating system's, and what is wrong with the file in words.
pub fn read(path: &Path, most: u64) -> io::Result<String> {
    if !std::fs::metadata(path)?.is_file() {
        return Err(io::Error::other("it is no regular file"));
    }
    let mut text = String::new();
    File::open(path)?.take(most + 1).read_to_string(&mut text)?;
    match text.len() as u64 > most {
        true => Err(io::Error::other(format!("it is longer than {most} bytes"))),
        false => Ok(text),
    }
}
