//! Errors in messages and contracts.

use thiserror::Error;

/// An error in a message or a contract. The text is one line.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum WireError {
    /// A topic is not in `msg_config/topics.yaml`, or it has another type or direction there.
    #[error("msg_config/topics.yaml has no topic {topic:?} of type {message} in that direction")]
    Contract {
        /// The name of the topic.
        topic: String,
        /// The type that the code uses.
        message: &'static str,
    },
    /// `msg_config/topics.yaml` cannot be parsed.
    #[error("msg_config/topics.yaml: {0}")]
    ContractFile(String),
    /// Bytes are not a message of the expected type.
    #[error("{bytes} bytes are not a {message}: {why}")]
    Decode {
        /// The expected type.
        message: &'static str,
        /// The number of bytes.
        bytes: usize,
        /// The reason why the bytes cannot be decoded.
        why: String,
    },
}
