//! Messages by which nodes report about themselves.

use super::{Header, Message, Time, message};
use serde::{Deserialize, Deserializer, Serialize};

message! {
    /// A line of a node's log.
    Log = "rcl_interfaces/msg/Log" {
        /// When the line was logged.
        stamp: Time,
        /// The severity: 10 debug, 20 info, 30 warn, 40 error, 50 fatal.
        level: u8,
        /// The name of the logger: the node's name with dots instead of slashes.
        name: String,
        /// The text.
        msg: String,
        /// The source file, if known.
        file: String,
        /// The function, if known.
        function: String,
        /// The line in the source file.
        line: u32,
    }

    /// UTF-8 text. Received bytes that are not UTF-8 are read as Latin-1, in which every byte is a character.
    StringMessage = "std_msgs/msg/String" {
        #[serde(deserialize_with = "any_text")]
        data: String,
    }
}

/// Decodes a string that may not be UTF-8. In CDR a string is a sequence of bytes, the last of which is 0.
fn any_text<'de, D: Deserializer<'de>>(deserializer: D) -> Result<String, D::Error> {
    let mut bytes = Vec::<u8>::deserialize(deserializer)?;
    bytes.pop_if(|last| *last == 0);
    Ok(String::from_utf8(bytes).unwrap_or_else(|why| why.into_bytes().into_iter().map(char::from).collect()))
}
message! {
    /// A value in a status, with its name.
    KeyValue = "diagnostic_msgs/msg/KeyValue" {
        #[serde(deserialize_with = "dq_common::text::deserialize_cut")]
        key: String,
        /// The value, which is never cut: a list of numbers must not lose its end.
        value: String,
    }

    /// The status of one component.
    DiagnosticStatus = "diagnostic_msgs/msg/DiagnosticStatus" {
        /// 0 OK, 1 WARN, 2 ERROR, 3 STALE.
        level: u8,
        #[serde(deserialize_with = "dq_common::text::deserialize_cut")]
        name: String,
        #[serde(deserialize_with = "dq_common::text::deserialize_cut")]
        message: String,
        #[serde(deserialize_with = "dq_common::text::deserialize_cut")]
        hardware_id: String,
        values: Vec<KeyValue>,
    }

    /// The statuses of several components at one time.
    DiagnosticArray = "diagnostic_msgs/msg/DiagnosticArray" {
        header: Header,
        status: Vec<DiagnosticStatus>,
    }
}
