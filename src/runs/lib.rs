#![doc = include_str!("README.md")]

mod announced;
mod given_goals;
mod motion_rows;
mod plot;
mod reader;
mod recorded;
mod replay;
mod run;
mod tables;
mod thinned;

pub use given_goals::GivenGoals;
pub use plot::plot;
pub use recorded::{Recorded, recorded, recorded_toward};
pub use replay::{Replayed, replay, replayable_from};
pub use run::{ArmCommands, Change, ChangeKind, MotionRow, RecordedRun, Sample};
pub use tables::csv;
pub use thinned::Thinned;

use thiserror::Error;

/// The largest number of joints of an arm. Without this limit, a bag could demand any amount of time and memory.
const MOST_JOINTS: usize = 64;

/// The reason why a bag cannot be analyzed.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RunError {
    /// The bag cannot be read.
    #[error(transparent)]
    Bag(#[from] dq_bags::BagError),
    /// The bag has no arm that could be drawn.
    #[error("{0}")]
    NoRobot(String),
    /// The caller named a topic of goals for an arm without a known servo, but no message on this topic is a goal.
    #[error("{run}: no message of geometry_msgs/msg/PoseStamped on {topic} is a goal{instead}")]
    NoGoals {
        /// The name of the run.
        run: String,
        /// The topic.
        topic: String,
        /// The end of the error message, which says what the bag has instead.
        instead: String,
    },
    /// The bag lacks data that a replay needs.
    #[error("the bag cannot be replayed: {0}")]
    NotReplayable(String),
    /// A list in the bag's parameters has more elements than an arm may have joints.
    #[error(
        "the parameters in the bag: {name} has {length} elements: expected at most {} joints per arm",
        MOST_JOINTS
    )]
    TooMany {
        /// The name of the parameter.
        name: String,
        /// The number of elements.
        length: usize,
    },
    /// The parameters in the bag are invalid.
    #[error("the parameters in the bag: {0}")]
    Parameters(#[from] dq_params::ParameterError),
    /// The servo rejects the parameters in the bag.
    #[error("the parameters in the bag: {0}")]
    Settings(#[from] dq_core::servo::SettingsError),
    /// The servo in the bag obeyed a live keep-out (one drawn on `~/keep_out`) that this version cannot read.
    #[error("the live keep-out {keep_out:?} in the bag: {why}")]
    KeepOut {
        /// The text of the keep-out, or its beginning.
        keep_out: String,
        /// The reason.
        why: dq_space::space::KeepOutError,
    },
    /// The scene cannot have the live keep-outs in the bag (those drawn on `~/keep_out`).
    #[error("the live keep-outs in the bag: {0}")]
    Scene(#[from] dq_space::space::SceneError),
}
