//! The servo cycle: (joint states, goal, time) → command and status. Every safety rule is in this module.
//!
//! This module does no I/O, reads no clock and starts no threads: time is an argument, so that each rule can be tested in fake time.
//!
//! Call [`Servo::cycle`] once per control period with the measured joint positions, and send its output to the arm. The output is `None`
//! until the arm is first driven: then send nothing.

mod close_pair;
mod consent;
mod cycle;
mod error_trend;
mod escape_phase;
mod event;
mod explanation;
mod filters;
mod free_directions;
mod goal;
mod joint_goal_error;
mod mode;
mod motion_record;
mod oscillation;
mod progress;
mod reason;
mod reconfiguration;
mod rejection;
mod revocation;
mod setpoint;
mod settings;
mod settings_error;
mod stability;
mod stall;
mod state;
mod status;
mod stream;
#[cfg(test)]
mod tests;
mod twist;

pub use close_pair::ClosePair;
pub use consent::{Consent, MotionRequest, Requester, Revoked, STREAM};
pub use cycle::{Measured, Servo};
pub use dq_contact::{Compliance, ContactFault, Load, WrenchReading};
pub use dq_kinematics::arm::{Arms, Reach, ToolSpeed};
pub use dq_limits::{
    Interface, JOINT_JERKS, JOINT_SPEEDS, Limits, POSITIVE, PositionLimits, RAMP_TIME, STOP_TIME, Violation,
};
pub use dq_link::{ArmFigures, Contact, JointOrder, JointReading, StateError, stamp_age};
pub use event::{Event, GoalMotion, GoalReading, JointGoalReading, Sent, TwistReading};
pub use filters::{CLEARANCE, Replaced};
pub use free_directions::FreeDirections;
pub use goal::{Goal, is_own_frame};
pub use joint_goal_error::JointGoalError;
use motion_record::MotionLog;
pub use motion_record::{MOTIONS, Motion, Outcome};
pub use reason::Reason;
pub use reconfiguration::{Detour, NoWayRound, Reconfiguration, Reconfigure};
pub use rejection::{Rejection, RejectionCounts};
pub use revocation::{Contended, Revocation, Rivals};
pub use settings::{BeyondReach, GoalFrameMode, GoalFrames, Posture, Settings};
pub use settings_error::SettingsError;
pub use stability::{RateBound, largest_rate};
pub use stall::Stall;
pub use state::State;
pub use status::{ContactStatus, Input, Status, joint_name};
pub use twist::Twist;
