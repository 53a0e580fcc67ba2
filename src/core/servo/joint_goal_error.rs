//! The reasons why a joint goal is rejected.

use dq_kinematics::arm::JointKind;
use thiserror::Error;

/// The reason why a message is not a valid joint goal of the arm.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum JointGoalError {
    /// The goal has no position for any joint.
    #[error("the joint goal has no positions")]
    Empty,
    /// The arm has no joint with this name.
    #[error("{name:?} is not a joint of the arm, expected {}", .joints.join(", "))]
    UnknownJoint {
        /// The name in the message.
        name: String,
        /// The names of the joints.
        joints: Vec<String>,
    },
    /// The message names this joint twice.
    #[error("joint {0:?} is named twice")]
    NamedTwice(String),
    /// The position is outside the limits of the joint.
    #[error("joint {joint} ({name}) cannot go to {position} {unit}: its limits are {lower} and {upper} {unit}", unit = .kind.unit())]
    OutsideLimits {
        /// The number of the joint, counted from 1, arm after arm.
        joint: usize,
        /// The name of the joint.
        name: String,
        /// Whether the joint is revolute or prismatic.
        kind: JointKind,
        /// The requested position \[rad, prismatic: m\].
        position: f64,
        /// The smallest position \[rad, prismatic: m\].
        lower: f64,
        /// The largest position \[rad, prismatic: m\].
        upper: f64,
    },
    /// The goal has no position for the joint with this number (counted from 1), and there is no joint state yet to take it from.
    #[error("the goal lacks joint {0}, whose position is unknown: there is no joint state yet")]
    NoState(usize),
}

impl JointGoalError {
    /// Returns the name of the reason.
    pub fn label(&self) -> &'static str {
        match self {
            Self::Empty => "empty",
            Self::UnknownJoint { .. } => "unknown_joint",
            Self::NamedTwice(_) => "named_twice",
            Self::OutsideLimits { .. } => "outside_limits",
            Self::NoState(_) => "no_state",
        }
    }
}
