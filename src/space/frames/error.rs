//! The reasons why a transform is not available, or was ignored.

use thiserror::Error;

/// The reason why the pose of a frame is not known. Times are in seconds.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum FrameError {
    /// No transform contains the frame.
    #[error("TF has no frame {0:?}")]
    Unknown(String),
    /// No chain of transforms connects the two frames.
    #[error("TF does not connect {frame:?} with {base:?}")]
    NotConnected {
        /// The name of the frame.
        frame: String,
        /// The name of the frame relative to which the pose was requested.
        base: String,
    },
    /// A frame is one of its own ancestors.
    #[error("the parents of {0:?} in TF go in a circle")]
    Loop(String),
    /// The frame is fixed to the tool, so the arm would chase a goal in this frame forever.
    #[error("{0:?} moves with the tool, so a goal in it cannot be followed: set frame_mode to latch")]
    OnTool(String),
    /// The requested stamp is older than the oldest transform that is kept.
    #[error("the stamp is {seconds:.3} s before the oldest transform of {frame:?} that is kept")]
    TooOld {
        /// The frame whose oldest transform is newer than the stamp.
        frame: String,
        /// The time from the stamp to the oldest transform \[s\].
        seconds: f64,
    },
    /// The requested stamp is newer than the newest transform, and no newer transform arrived in time.
    #[error("the stamp is {seconds:.3} s after the newest transform of {frame:?}")]
    TooNew {
        /// The frame whose newest transform is older than the stamp.
        frame: String,
        /// The time from the newest transform to the stamp \[s\].
        seconds: f64,
    },
}

impl FrameError {
    /// Returns the name of the reason.
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

    /// Returns whether a transform that arrives later may make the pose known.
    pub fn may_pass(&self) -> bool {
        !matches!(self, Self::TooOld { .. } | Self::OnTool(_))
    }
}

/// The reason why a transform was ignored.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
pub enum Ignored {
    /// The name of a frame is empty, or both names are the same.
    #[error("a transform must lead from one named frame to another")]
    Names,
    /// A number is not finite or exceeds any distance on Earth, or the quaternion is not a unit quaternion.
    #[error("a transform must have finite numbers and a unit quaternion")]
    Numbers,
    /// There are too many frames or transforms.
    #[error("there are more frames than are kept")]
    TooMany,
}
