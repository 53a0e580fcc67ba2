//! The content of a bag: topics and messages.

use dq_common::text::{NAME, shown};
use dq_messages::WireError;
use dq_messages::decode;
use dq_messages::messages::Message;
use std::sync::Arc;

/// One topic of a bag.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Topic {
    /// The fully qualified name.
    pub name: String,
    /// `package/msg/Name`.
    pub message: String,
    /// The number of its messages in the bag.
    pub count: u64,
}

/// One message of a bag.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BagMessage {
    /// The topic's fully qualified name.
    pub topic: Arc<str>,
    /// `package/msg/Name`.
    pub message: Arc<str>,
    /// When it was recorded \[ns since 1970\].
    pub log_time: i64,
    /// The CDR bytes, with their encapsulation header of four bytes.
    pub cdr: Vec<u8>,
}

impl BagMessage {
    /// Decodes the message.
    ///
    /// # Errors
    /// [`WireError::Decode`] if it is of another type, or its bytes are not a complete message.
    pub fn decode<M: Message>(&self) -> Result<M, WireError> {
        if *self.message != *M::TYPE {
            let why = format!("they are a {} of {}", shown(&self.message, NAME), shown(&self.topic, NAME));
            return Err(WireError::Decode { message: M::TYPE, bytes: self.cdr.len(), why });
        }
        decode(&self.cdr)
    }
}
