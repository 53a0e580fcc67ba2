//! The reasons why a joint state is rejected.

use dq_common::text::cut;
use dq_kinematics::arm::bounds::NumberError;
use thiserror::Error;

/// The reason why a message is not a valid joint state of the arm.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum StateError {
    /// A position is not finite or beyond its bounds.
    #[error(transparent)]
    Number(#[from] NumberError),
    /// A joint of the arm is not in the joint state.
    #[error("joint {joint:?} is not in the joint state (it has {names:?})")]
    MissingJoint {
        /// The name of the joint.
        joint: String,
        /// The first joint names in the message.
        names: Vec<String>,
    },
    /// The lists of a joint state have different lengths.
    #[error("{names} joint names with {positions} positions: expected as many of each")]
    WrongLength {
        /// The number of joint names.
        names: usize,
        /// The number of positions.
        positions: usize,
    },
}

impl StateError {
    /// Returns the error for `joint`, which is not among the `names` of a message.
    pub(crate) fn missing(joint: &str, names: &[String]) -> Self {
        let names = names.iter().take(8).map(|name| cut(name).into_owned()).collect();
        Self::MissingJoint { joint: joint.to_owned(), names }
    }

    /// Returns the name of the reason.
    pub fn label(&self) -> &'static str {
        match self {
            Self::Number(number) => number.label(),
            Self::MissingJoint { .. } => "missing_joint",
            Self::WrongLength { .. } => "wrong_length",
        }
    }
}
