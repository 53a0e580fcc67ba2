#![doc = include_str!("README.md")]
#![warn(clippy::unwrap_used, clippy::expect_used)]
// Both macros panic if nobody reads the stream. Results go through `cli::print`, everything else through `stderr`.
#![warn(clippy::print_stdout, clippy::print_stderr)]

mod commands;
mod contract;
mod cycle_record;
mod motion_report;
mod poses;
mod readings;
mod servo_kind;
mod status;
mod timing;

pub use commands::{Command, command_topic};

/// The types that the code from the macro [`with_command`] refers to.
#[doc(hidden)]
pub mod command_types {
    pub use dq_core::servo::Interface;
    pub use dq_messages::messages::{Float64MultiArray, JointTrajectory};
}

pub use contract::Contract;
pub use cycle_record::{CycleRecord, Recorded, RecordedParameters, Saved};
pub use motion_report::{MotionContext, MotionReport, Outcome};
pub use poses::{point_message, pose_message, pose_numbers, transform_message};
pub use readings::{
    error_distance, goal_reading, joint_goal_reading, joint_reading, transform_reading, twist_reading,
    wrench_reading,
};
pub use servo_kind::{LawNames, ServoKind};
pub use status::{
    CycleJitter, KeyValues, Reported, ServoReport, StatusReport, distance, microseconds, milliseconds,
    rivalry,
};
pub use timing::{CycleTiming, SpreadFigures, TimingFigures};
