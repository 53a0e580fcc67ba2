//! The reference work repeated: simulations of its laws, metrics, comparison, figures.

mod base_shift;
mod comparison;
mod experiment;
mod figures;
mod laws;
mod metrics;
mod reproduce;
mod simulation;
mod sweep;
mod wrong_sign;

pub use comparison::{Claim, Row};
pub use experiment::Experiment;
pub use laws::{INTERVAL, Laboratory, SimulatedRun};
pub use metrics::{Measured, Metrics, SettlingTimes, tool_poses};
pub use reproduce::{Reproduction, reproduce};
pub use simulation::{Precision, Span, Trajectory, follow, follow_freely, follow_two, pose, two_arms};
pub use sweep::{LawSummary, Outcome, Pair, SweepSummary, sweep};

use crate::arm::ArmError;
use thiserror::Error;

/// Why there is no report.
#[derive(Debug, Error)]
pub enum PaperError {
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
    /// A figure.
    #[error(transparent)]
    Draw(#[from] crate::draw::DrawError),
    /// The integration gave up.
    #[error("the simulation failed: {0}")]
    Simulation(String),
}
