//! What can be wrong with what goes over the wire.

use thiserror::Error;

/// An error of the wire room. Each message is one line.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum WireError {
    /// A topic is not in `msg_config/topics.yaml`, or its type or direction there is another.
    #[error("msg_config/topics.yaml has no topic {topic:?} of type {message} in that direction")]
    Contract {
        /// The topic.
        topic: String,
        /// The type that the code uses.
        message: &'static str,
    },
    /// `msg_config/topics.yaml` does not parse.
    #[error("msg_config/topics.yaml: {0}")]
    ContractFile(String),
    /// Bytes are no message of that type.
    #[error("{bytes} bytes are no {message}: {why}")]
    Decode {
        /// The type.
        message: &'static str,
        /// How many they are.
        bytes: usize,
        /// What is wrong with them.
        why: String,
    },
}
