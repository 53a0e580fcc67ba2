//! The comparison of section 8 of the paper.

use super::figures::Runs;
use super::{Laboratory, Metrics, PaperError, SimulatedRun};
use crate::arm::ArmState;
use serde::Serialize;
use std::hint::black_box;
use std::time::Instant;

/// One law in the comparison.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// The law's name.
    pub law: &'static str,
    /// Its gain [1/s].
    pub gain: f64,
    /// How long the motion was followed \[s\].
    #[serde(rename = "duration_s")]
    pub duration: f64,
    /// The motion in numbers.
    #[serde(flatten)]
    pub metrics: Metrics,
    /// Kinematics and law, median \[ns\].
    #[serde(rename = "computation_ns_per_step")]
    pub computation_ns: f64,
}

/// diffc with logc's gain, diffc with its own, logc, double_geodesic.
///
/// # Errors
/// [`PaperError`].
pub fn comparison(lab: &Laboratory, runs: &Runs) -> Result<[Row; 4], PaperError> {
    let constants = &lab.experiment;
    let row = |run: &SimulatedRun, gain, duration| {
        Ok::<_, PaperError>(Row {
            law: run.controller.law.name(),
            gain,
            duration,
            metrics: lab.metrics(run)?,
            computation_ns: computation_ns(lab, run)?,
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

/// Median time of a step's computation along the run: kinematics, then the law \[ns\].
fn computation_ns(lab: &Laboratory, run: &SimulatedRun) -> Result<f64, PaperError> {
    const REPEATS: usize = 9;
    let mut state = ArmState::new(&lab.chain);
    let mut theta_dot = vec![0.0; lab.chain.joint_count()];
    let mut times = Vec::with_capacity(REPEATS);
    for _ in 0..REPEATS {
        let begin = Instant::now();
        for theta in &run.trajectory.states {
            lab.chain.evaluate(black_box(theta), &mut state)?;
            run.controller.joint_velocity(&state, &run.goal, &mut theta_dot);
            black_box(&theta_dot);
        }
        times.push(begin.elapsed().as_nanos() as f64 / run.trajectory.states.len() as f64);
    }
    times.sort_by(f64::total_cmp);
    Ok(times[REPEATS / 2])
}
