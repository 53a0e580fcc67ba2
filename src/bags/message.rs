//! The content of a bag: topics and messages.

use dq_common::text::{NAME, shown};
use dq_messages::WireError;
use dq_messages::decode;
use dq_messages::messages::Message;
use std::sync::Arc;

/// One topic of a bag.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Topic {
    /// The fully qualified name of the topic.
    pub name: String,
    /// The type of the messages: `package/msg/Name`.
    pub message: String,
    /// The number of the topic's messages that were found so far.
    pub count: u64,
}

/// One message of a bag.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BagMessage {
    /// The fully qualified name of the topic.
    pub topic: Arc<str>,
    /// The type of the message: `package/msg/Name`.
    pub message: Arc<str>,
    /// When the message was recorded \[ns since 1970\].
    pub log_time: i64,
    /// The CDR bytes of the message, with the encapsulation header of four bytes.
    pub cdr: Vec<u8>,
}

impl BagMessage {
    /// Decodes the message.
    ///
    /// # Errors
    /// [`WireError::Decode`] if the message has another type, or its bytes are incomplete.
    pub fn decode<M: Message>(&self) -> Result<M, WireError> {
        if *self.message != *M::TYPE {
            let why = format!("they are a {} of {}", shown(&self.message, NAME), shown(&self.topic, NAME));
            return Err(WireError::Decode { message: M::TYPE, bytes: self.cdr.len(), why });
        }
        decode(&self.cdr)
    }
}
