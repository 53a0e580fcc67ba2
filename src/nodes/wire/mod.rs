//! What goes over the wire between the servo and others: the topic contract, the status and the record for replay. No DDS.

mod commands;
mod contract;
mod cycle_record;
mod motion_report;
mod readings;
mod servo_kind;
pub(crate) mod status;
mod timing;

pub use commands::{Command, Rewrite, command_array, command_topic, command_trajectory};
pub use contract::Contract;
pub use cycle_record::{CycleRecord, Recorded, RecordedParameters, Saved};
pub use dq_messages::*;
pub use motion_report::{MotionContext, MotionReport, Outcome};
pub use readings::{error_distance, goal_reading, joint_reading, transform_reading, twist_reading};
pub use servo_kind::{LawNames, ServoKind};
pub use status::{CycleJitter, ServoReport, StatusReport, distance};
pub use timing::{CycleTiming, SpreadFigures, TimingFigures};
