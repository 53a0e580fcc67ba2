#![doc = include_str!("README.md")]
#![warn(clippy::unwrap_used, clippy::expect_used)]
// Both macros panic if nobody reads the stream. Results go through `cli::print`, everything else through stderr.
#![warn(clippy::print_stdout, clippy::print_stderr)]

mod cdr;
mod contract;
mod error;
mod in_place;
mod interfaces;
pub mod messages;
mod parameter_messages;
mod poses;
mod qos;
mod type_description;
pub mod visualization;

pub use cdr::{CDR_BE, CDR_LE, decode, decode_payload};
pub use contract::{Direction, NodeContract, TopicContract};
pub use error::WireError;
pub use in_place::{InPlace, Reuse};
pub use interfaces::{definition, type_hash};
pub use parameter_messages::*;
pub use poses::PoseNumbers;
pub use qos::{DurabilityKind, LivelinessKind, OfferedQos, ReliabilityKind};
pub use type_description::{GetTypeDescription, describe};
