//! Recorded runs, explained: figures and metrics of any bag of such a run, and the replay of one through the servo cycle.

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
pub use run::{ArmCommands, Change, MotionRow, RecordedRun, Sample, What};
pub use thinned::Thinned;

use thiserror::Error;

/// Arms of more joints are not explained: what a bag says of itself is not trusted with time and memory.
const MOST_JOINTS: usize = 64;

/// Why a bag cannot be explained.
#[derive(Debug, Error)]
pub enum RunError {
    /// It could not be read.
    #[error(transparent)]
    Bag(#[from] dq_bags::BagError),
    /// It has no arm that could be drawn.
    #[error("{0}")]
    NoRobot(String),
    /// It has not what a replay needs.
    #[error("the bag cannot be replayed: {0}")]
    NotReplayable(String),
    /// A list in its parameters is longer than that of any arm.
    #[error(
        "the parameters in the bag: {name} has {length} elements, and no arm of more than {} joints is explained",
        MOST_JOINTS
    )]
    TooMany {
        /// The parameter.
        name: String,
        /// Its elements.
        length: usize,
    },
    /// The parameters in it are not as they should be.
    #[error("the parameters in the bag: {0}")]
    Parameters(#[from] dq_params::ParameterError),
    /// The servo does not take them.
    #[error("the parameters in the bag: {0}")]
    Settings(#[from] dq_core::servo::SettingsError),
}
