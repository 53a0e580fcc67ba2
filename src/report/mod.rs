//! What is told about motions: simulations of the laws, metrics, figures.

mod experiment;

pub use experiment::Experiment;

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
}
