//! What goes over the wire, as data: messages, the topic contract, the status and the cycle's label. No DDS.

mod cdr;
mod commands;
mod contract;
mod cycle_label;
mod error;
mod framed_goal_label;
mod in_place;
mod interfaces;
pub mod messages;
mod motion_report;
mod parameter_messages;
mod qos;
mod readings;
pub(crate) mod status;
mod type_description;
pub mod visualization;
mod wiring;

pub use cdr::decode;
pub(crate) use cdr::{CDR_BE, CDR_LE, decode_payload};
pub use commands::{Command, GUARD_LABEL, Rewrite, command_array, command_topic, command_trajectory};
pub use contract::{Contract, Direction, NodeContract, TopicContract};
pub use cycle_label::{ArmLabel, CycleLabel, NoLabel};
pub use error::WireError;
pub use framed_goal_label::{FramedGoalFate, FramedGoalLabel, PlacedGoal};
pub use in_place::{InPlace, Reuse};
pub use interfaces::{definition, type_hash};
pub(crate) use motion_report::MotionContext;
pub use motion_report::{MotionReport, Outcome};
pub(crate) use parameter_messages::*;
pub use parameter_messages::{Parameter, ParameterDescriptor, ParameterEvent};
pub use qos::{DurabilityKind, LivelinessKind, OfferedQos, ReliabilityKind};
pub use readings::{PoseNumbers, pose_numbers};
pub use status::StatusReport;
pub(crate) use type_description::{GetTypeDescription, describe};
pub use wiring::{Wiring, joint_names};
