//! What goes over the wire, as data: messages, the topic contract, the status and the record for replay. No DDS.

mod cdr;
mod commands;
mod contract;
mod cycle_record;
mod error;
mod in_place;
mod interfaces;
pub mod messages;
mod motion_report;
mod parameter_messages;
mod qos;
mod readings;
mod servo_kind;
pub(crate) mod status;
mod type_description;
pub mod visualization;

pub use cdr::decode;
pub(crate) use cdr::{CDR_BE, CDR_LE, decode_payload};
pub use commands::{Command, Rewrite, command_array, command_topic, command_trajectory};
pub use contract::{Contract, Direction, NodeContract, TopicContract};
pub use cycle_record::{CycleRecord, EVENTS, Recorded, RecordedParameters};
pub use error::WireError;
pub use in_place::{InPlace, Reuse};
pub use interfaces::{definition, type_hash};
pub(crate) use motion_report::MotionContext;
pub use motion_report::{MotionReport, Outcome};
pub(crate) use parameter_messages::*;
pub use parameter_messages::{Parameter, ParameterDescriptor, ParameterEvent};
pub use qos::{DurabilityKind, LivelinessKind, OfferedQos, ReliabilityKind};
pub use readings::{PoseNumbers, pose_numbers};
pub use servo_kind::ServoKind;
pub use status::StatusReport;
pub(crate) use type_description::{GetTypeDescription, describe};
