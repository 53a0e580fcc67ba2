//! Why a transform is not there, or was not taken.

use thiserror::Error;

/// Why a frame's place is not known. Times are seconds.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum FrameError {
    /// No transform names the frame.
    #[error("TF has no frame {0:?}")]
    Unknown(String),
    /// No chain of transforms leads from one frame to the other.
    #[error("TF does not connect {frame:?} with {base:?}")]
    NotConnected {
        /// The frame.
        frame: String,
        /// The frame in which it was asked for.
        base: String,
    },
    /// A frame is among its own parents.
    #[error("the parents of {0:?} in TF go in a circle")]
    Loop(String),
    /// The frame stands still on the tool: a goal that moves with it would be chased for ever.
    #[error("{0:?} moves with the tool, so that a goal in it cannot be followed: frame_mode latch takes it")]
    OnTool(String),
    /// The oldest transform that is kept is younger.
    #[error("the stamp is {seconds:.3} s before the oldest transform of {frame:?} that is kept")]
    TooOld {
        /// The frame with that transform.
        frame: String,
        /// By how much.
        seconds: f64,
    },
    /// The newest transform is older, and none came in time.
    #[error("the stamp is {seconds:.3} s after the newest transform of {frame:?}")]
    TooNew {
        /// The frame with that transform.
        frame: String,
        /// By how much.
        seconds: f64,
    },
}

impl FrameError {
    /// The reason in one word.
    pub fn label(&self) -> &'static str {
        match self {
            Self::Unknown(_) => "unknown_frame",
            Self::NotConnected { .. } => "unconnected_frame",
            Self::Loop(_) => "frame_loop",
            Self::OnTool(_) => "frame_on_tool",
            Self::TooOld { .. } => "transform_too_old",
            Self::TooNew { .. } => "transform_too_new",
        }
    }

    /// Whether a transform that is still to come may mend it.
    pub fn may_pass(&self) -> bool {
        !matches!(self, Self::TooOld { .. } | Self::OnTool(_))
    }
}

/// Why a transform was not taken.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
pub enum Ignored {
    /// A frame's name is empty, or both are the same.
    #[error("a transform must lead from one named frame to another")]
    Names,
    /// A number is not finite or farther than any place on Earth, or the quaternion is not unit.
    #[error("a transform must have finite numbers and a unit quaternion")]
    Numbers,
    /// There are too many frames.
    #[error("there are more frames than are kept")]
    TooMany,
}
