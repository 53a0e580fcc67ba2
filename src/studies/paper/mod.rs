//! Reproduces the paper: the simulations of its laws, and their metrics, comparison and figures.
//!
//! "The paper" is Akhil Sathuluri, *Dual Quaternion Based Control*, project report, 2018,
//! <https://github.com/akhilsathuluri/Dual_Quaternion_Control>. Its equations, sections and figures are cited by their numbers in `Project
//! Report/Report_Submission.pdf` there.

mod base_shift;
mod claim;
mod claims;
mod comparison;
mod equation_claims;
mod equations;
mod experiment;
mod figures;
mod gain_sweep;
mod laws;
mod metrics;
mod reproduce;
mod simulation;
mod task_space;
mod wrong_sign;

pub use claim::Claim;
pub use comparison::Row;
pub use equations::{LogarithmEquations, PoseEquations};
pub use experiment::Experiment;
pub use gain_sweep::Swept;
pub use laws::{Laboratory, SimulatedRun};
pub use metrics::Metrics;
pub use reproduce::{Reproduction, reproduce};
pub use simulation::{INTERVAL, Trajectory, follow, integrate};
pub use task_space::{TaskSpaceLogc, TaskSpaceMetrics, half_log_rate};

use dq_kinematics::arm::ArmError;
use thiserror::Error;

/// The reason why the paper could not be reproduced.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum PaperError {
    /// The file of constants is invalid.
    #[error("{file}: {why}")]
    Experiment {
        /// The path of the file.
        file: String,
        /// The error in the file.
        why: String,
    },
    /// The constants do not match the arm.
    #[error("the experiment's theta_initial and theta_desired do not fit the arm")]
    Arm(#[from] ArmError),
    /// The integration of a motion failed.
    #[error("the simulation failed: {0}")]
    Simulation(String),
}
