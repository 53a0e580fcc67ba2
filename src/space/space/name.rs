//! Short names that are copied like numbers.

use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;
use thiserror::Error;

/// Largest length of a name in bytes.
pub const LONGEST: usize = 24;

/// A short name of letters, digits and `_ - . /`.
#[derive(Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Name {
    bytes: [u8; LONGEST],
    length: u8,
}

/// The error for a text that is not a [`Name`].
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("{0:?} is not a name: expected {expected}", expected = self.expected())]
pub struct NameError(String);

impl NameError {
    /// Returns the description of a valid name.
    pub(super) fn expected(&self) -> String {
        format!("a name of 1 to {LONGEST} letters, digits, '_', '-', '.' or '/'")
    }
}

impl FromStr for Name {
    type Err = NameError;

    fn from_str(text: &str) -> Result<Self, NameError> {
        let is_right = |byte: u8| byte.is_ascii_alphanumeric() || b"_-./".contains(&byte);
        let mut bytes = [0; LONGEST];
        match bytes.get_mut(..text.len()).filter(|room| !room.is_empty() && text.bytes().all(is_right)) {
            Some(room) => room.copy_from_slice(text.as_bytes()),
            None => return Err(NameError(dq_common::text::cut(text).into_owned())),
        }
        Ok(Self { bytes, length: text.len() as u8 })
    }
}

impl Name {
    /// Returns the name as text.
    pub fn as_str(&self) -> &str {
        // The bytes are ASCII by construction.
        std::str::from_utf8(&self.bytes[..usize::from(self.length)]).unwrap_or_default()
    }
}

impl fmt::Display for Name {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

impl fmt::Debug for Name {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:?}", self.as_str())
    }
}
