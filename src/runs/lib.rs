//! Analyzes recorded runs: figures and metrics of any bag of such a run, and its replay through the servo cycle.

mod announced;
mod csv;
mod motion_rows;
mod plot;
mod reader;
mod recorded;
mod replay;
mod run;
mod thinned;

pub use csv::csv;
pub use plot::plot;
pub use recorded::{Recorded, recorded};
pub use replay::{Replayed, replay, replayable_from};
pub use run::{ArmCommands, Change, ChangeKind, MotionRow, RecordedRun, Sample};
pub use thinned::Thinned;

use thiserror::Error;

/// The largest number of joints of an arm, so that a bag cannot demand any amount of time and memory.
const MOST_JOINTS: usize = 64;

/// Why a bag cannot be analyzed.
#[derive(Debug, Error)]
pub enum RunError {
    /// The bag cannot be read.
    #[error(transparent)]
    Bag(#[from] dq_bags::BagError),
    /// The bag has no arm that could be drawn.
    #[error("{0}")]
    NoRobot(String),
    /// The bag lacks what a replay needs.
    #[error("the bag cannot be replayed: {0}")]
    NotReplayable(String),
    /// A list in its parameters is longer than that of any arm.
    #[error(
        "the parameters in the bag: {name} has {length} elements: expected at most {} joints per arm",
        MOST_JOINTS
    )]
    TooMany {
        /// The parameter.
        name: String,
        /// The number of elements.
        length: usize,
    },
    /// Its parameters are invalid.
    #[error("the parameters in the bag: {0}")]
    Parameters(#[from] dq_params::ParameterError),
    /// The servo refuses its parameters.
    #[error("the parameters in the bag: {0}")]
    Settings(#[from] dq_core::servo::SettingsError),
}
