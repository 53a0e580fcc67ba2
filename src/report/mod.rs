//! What is told about motions: simulations of the laws, metrics, figures.

mod base_shift;
mod canvas;
mod chart;
mod comparison;
mod experiment;
mod figures;
mod laws;
mod metrics;
mod plot;
mod recorded;
mod replay;
mod reproduce;
mod simulation;
mod space;
mod style;
mod sweep;
mod timeline;
mod wrong_sign;

pub use canvas::Figure;
pub use comparison::{Claim, Row};
pub use experiment::Experiment;
pub use laws::{INTERVAL, Laboratory, Run};
pub use metrics::{Measured, Metrics, SettlingTimes, tool_poses};
pub use plot::plot;
pub use recorded::{Change, Fallback, MotionRow, Recorded, Sample, What, recorded};
pub use replay::{Replayed, replay};
pub use reproduce::{Report, reproduce};
pub use simulation::{Precision, Span, Trajectory, follow, follow_freely, follow_two, pose, two_arms};

pub use space::frameplotter;
pub use sweep::{LawSummary, Outcome, Pair, Summary, sweep};
pub use timeline::Timeline;

use crate::arm::ArmError;
use thiserror::Error;

/// Why there is no report.
#[derive(Debug, Error)]
pub enum ReportError {
    /// The file of constants.
    #[error("{file}: {why}")]
    Experiment {
        /// The file.
        file: String,
        /// What is wrong.
        why: String,
    },
    /// The constants do not fit the arm.
    #[error("the experiment does not fit the arm: {0}")]
    Arm(#[from] ArmError),
    /// A figure could not be drawn.
    #[error("a figure could not be drawn: {0}")]
    Drawing(String),
    /// A file could not be written.
    #[error("{file} cannot be written: {why}")]
    Output {
        /// The file or folder.
        file: String,
        /// Why.
        why: String,
    },
    /// A bag could not be read.
    #[error(transparent)]
    Bag(#[from] crate::record::BagError),
    /// A bag has no arm that could be drawn.
    #[error("{0}")]
    NoRobot(String),
    /// A bag has not what a replay needs.
    #[error("the bag cannot be replayed: {0}")]
    NotReplayable(String),
    /// A bag's parameters are not as they should be.
    #[error("the parameters in the bag: {0}")]
    Parameters(#[from] crate::config::ConfigError),
    /// The integration gave up.
    #[error("the simulation failed: {0}")]
    Simulation(String),
}

/// Writes a whole file.
fn write(path: &std::path::Path, content: &[u8]) -> Result<(), ReportError> {
    std::fs::write(path, content)
        .map_err(|why| ReportError::Output { file: path.display().to_string(), why: why.to_string() })
}
