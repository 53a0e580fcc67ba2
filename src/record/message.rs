//! What is in a bag: topics and messages.

use crate::wire::WireError;
use crate::wire::decode;
use crate::wire::messages::Message;
use std::sync::Arc;

/// One topic of a bag.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Topic {
    /// The fully qualified name.
    pub name: String,
    /// `package/msg/Name`.
    pub message: String,
    /// Messages in the bag.
    pub count: u64,
}

/// One message of a bag.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BagMessage {
    /// The topic's fully qualified name.
    pub topic: Arc<str>,
    /// `package/msg/Name`.
    pub message: Arc<str>,
    /// When it was recorded \[ns\] since the Unix epoch.
    pub log_time: i64,
    /// The CDR bytes with their encapsulation header of four bytes.
    pub cdr: Vec<u8>,
}

impl BagMessage {
    /// The message as a value.
    ///
    /// # Errors
    /// [`WireError::Decode`] where it is of another type, or its bytes are no whole message.
    pub fn decode<M: Message>(&self) -> Result<M, WireError> {
        if *self.message != *M::TYPE {
            let why = format!("they are a {} of {}", shown(&self.message, NAME), shown(&self.topic, NAME));
            return Err(WireError::Decode { message: M::TYPE, bytes: self.cdr.len(), why });
        }
        decode(&self.cdr)
    }
}

/// How much of a name out of a bag is shown, and of what is wrong with the bag [characters].
pub(crate) const NAME: usize = 80;
pub(super) const REASON: usize = 400;

/// A text of a bag as it can stand in a figure, a table and a line: without control characters, and no longer than `longest`.
pub(crate) fn shown(text: &str, longest: usize) -> String {
    let clean = |c: char| if c.is_control() { char::REPLACEMENT_CHARACTER } else { c };
    let mut shown: String = text.chars().take(longest).map(clean).collect();
    if text.chars().nth(longest).is_some() {
        shown.push('…');
    }
    shown
}
