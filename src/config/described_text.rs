//! The text of a robot description, given as a parameter or as the name of a file.

use dq_common::text::cut;
use dq_common::text_file;
use dq_description::LONGEST_DESCRIPTION;
use dq_params::{ParameterError, ParameterOverride, Value};
use std::borrow::Cow;
use std::io;
use std::path::{Path, PathBuf};

/// The text of a robot description among given parameters.
pub(super) struct GivenText<'a> {
    pub bytes: Cow<'a, [u8]>,
    /// Where the text comes from: the parameter that has it, or the name of the file.
    pub source: &'a str,
    /// The path of the file, if the text comes from a file.
    pub file: Option<PathBuf>,
}

impl<'a> GivenText<'a> {
    /// Returns the text that one of two parameters gives; `None` if neither is set. The first parameter has the text, the second
    /// has the name of a file.
    pub fn find(
        given: &'a [ParameterOverride],
        [name, of_file]: [&'static str; 2],
    ) -> Result<Option<Self>, ParameterError> {
        Ok(match (text(given, name), text(given, of_file)) {
            (Some(text), _) if !text.contains('<') => return Err(no_description(text, [name, of_file])),
            (Some(text), _) => Some(Self { bytes: Cow::Borrowed(text.as_bytes()), source: name, file: None }),
            (None, Some(file)) => Some(Self {
                bytes: Cow::Owned(read_file(file)?),
                source: file,
                file: Some(PathBuf::from(file)),
            }),
            (None, None) => None,
        })
    }
}

fn read_file(file: &str) -> Result<Vec<u8>, ParameterError> {
    let error = |why: io::Error| ParameterError::File { file: file.to_owned(), why: why.to_string() };
    text_file::bytes(Path::new(file), LONGEST_DESCRIPTION as u64).map_err(error)
}

/// Returns the text of `bytes`. If the bytes are not UTF-8, reads them as Latin-1, in which every byte is a character, and also
/// returns a message.
pub(super) fn decoded(bytes: Cow<[u8]>) -> (String, Option<String>) {
    match str::from_utf8(&bytes) {
        Ok(text) => (text.to_owned(), None),
        Err(why) => {
            let line = 1 + bytes[..why.valid_up_to()].iter().filter(|byte| **byte == b'\n').count();
            let text = bytes.iter().copied().map(char::from).collect();
            (text, Some(format!("line {line} is not UTF-8: the description is read as Latin-1")))
        }
    }
}

/// Returns the error for `text`, which has no XML element. The text is the value of the parameter `name`. The parameter `of_file`
/// takes the name of a file.
fn no_description(text: &str, [name, of_file]: [&str; 2]) -> ParameterError {
    let why = match text.contains('/') || text.contains(".urdf") {
        true => format!("is a path, not a URDF: give a file as {of_file}"),
        false => "is not a URDF".to_owned(),
    };
    let why = format!("{:?} {why}", cut(text.trim()));
    ParameterError::File { file: name.to_owned(), why }
}

/// Returns the last of the `given` values with the name `name`. Returns `None` if there is none, or if the value is the empty text,
/// which is the default.
pub(super) fn text<'a>(given: &'a [ParameterOverride], name: &str) -> Option<&'a str> {
    let values = given.iter().rev().filter(|value| value.name == name);
    let mut texts =
        values.filter_map(|value| if let Value::String(text) = &value.value { Some(text) } else { None });
    texts.next().map(String::as_str).filter(|text| !text.is_empty())
}
