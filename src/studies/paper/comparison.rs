//! The comparison of section 8 of the paper.

use super::figures::Runs;
use super::{Laboratory, Metrics, PaperError, SimulatedRun};
use serde::Serialize;

/// The result of one law in the comparison.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// The name of the law.
    pub law: &'static str,
    /// The gain of the law [1/s].
    pub gain: f64,
    /// The duration of the motion \[s\].
    #[serde(rename = "duration_s")]
    pub duration: f64,
    /// The metrics of the motion.
    #[serde(flatten)]
    pub metrics: Metrics,
}

/// Compares diffc with logc's gain, diffc with its own gain, logc, and double_geodesic.
///
/// # Errors
/// [`PaperError`] if a simulation fails.
pub fn comparison(lab: &Laboratory, runs: &Runs) -> Result<[Row; 4], PaperError> {
    let constants = &lab.experiment;
    let row = |run: &SimulatedRun, gain, duration| {
        Ok::<_, PaperError>(Row {
            law: run.controller.law.name(),
            gain,
            duration,
            metrics: lab.metrics(run)?,
        })
    };
    let (diffc, equal) = (constants.diffc, constants.comparison);
    Ok([
        row(&runs.diffc_low, diffc.low_gain, diffc.duration)?,
        row(&runs.diffc, diffc.gain, diffc.duration)?,
        row(&runs.logc, equal.gain, equal.duration)?,
        row(&runs.double_geodesic, equal.gain, equal.duration)?,
    ])
}
