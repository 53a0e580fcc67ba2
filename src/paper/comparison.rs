//! The comparison of section 8 of the paper.

use super::figures::Runs;
use super::{Laboratory, Metrics, PaperError, SimulatedRun};
use crate::arm::ArmState;
use serde::Serialize;
use serde_json::{Value, json};
use std::hint::black_box;
use std::time::Instant;

/// One law in the comparison.
#[derive(Clone, Debug)]
pub struct Row {
    /// The law's name.
    pub law: &'static str,
    /// Its gain [1/s].
    pub gain: f64,
    /// \[s\]
    pub duration: f64,
    /// Its figures.
    pub metrics: Metrics,
    /// Kinematics and law, median \[ns\].
    pub computation_ns: f64,
}

/// What the paper says, and what came out.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Claim {
    /// The claim.
    pub claim: String,
    /// Whether it holds here.
    pub holds: bool,
    /// By which numbers.
    pub evidence: String,
}

/// diffc with logc's gain, diffc with its own, logc, double_geodesic.
///
/// # Errors
/// [`PaperError`].
pub fn comparison(lab: &Laboratory, runs: &Runs) -> Result<Vec<Row>, PaperError> {
    let constants = &lab.experiment;
    let row = |run: &SimulatedRun, gain, duration| {
        Ok(Row {
            law: run.controller.law.name(),
            gain,
            duration,
            metrics: lab.metrics(run)?,
            computation_ns: computation_ns(lab, run)?,
        })
    };
    let (diffc, equal) = (constants.diffc, constants.comparison);
    [
        row(&runs.diffc_low, diffc.low_gain, diffc.duration),
        row(&runs.diffc, diffc.gain, diffc.duration),
        row(&runs.logc, equal.gain, equal.duration),
        row(&runs.double_geodesic, equal.gain, equal.duration),
    ]
    .into_iter()
    .collect()
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

impl Row {
    /// As `results.json` has it.
    pub fn json(&self) -> Value {
        let m = &self.metrics;
        let mut row = json!({
            "law": self.law,
            "gain": self.gain,
            "duration_s": self.duration,
            "settling_time_s": m.settling_time_s,
            "path_length_m": m.path_length_m,
            "straight_line_m": m.straight_line_m,
            "path_ratio": m.path_ratio,
            "overshoot_mm": m.overshoot_mm,
            "peak_joint_speed_rad_s": m.peak_joint_speed_rad_s,
            "effort": m.effort,
            "smallest_singular_value": m.smallest_singular_value,
            "computation_ns_per_step": self.computation_ns,
        });
        let end = self.duration;
        row[format!("joint_error_percent_at_{end}s")] = json!(m.joint_error_percent);
        row[format!("position_error_mm_at_{end}s")] = json!(m.position_error_mm);
        row[format!("rotation_error_deg_at_{end}s")] = json!(m.rotation_error_deg);
        row
    }
}

/// What section 8 and section 10 of the paper claim.
///
/// # Errors
/// [`PaperError`].
pub fn claims(lab: &Laboratory, runs: &Runs, rows: &[Row]) -> Result<Vec<Claim>, PaperError> {
    let [low, diffc, logc, _] = rows else { return Ok(Vec::new()) };
    let decay = lab.metrics(&runs.logc_decay)?;
    let seconds = |time: Option<f64>| time.map_or("not".to_owned(), |time| format!("{time:.2} s"));
    let order = |metrics: &Metrics| {
        let times = &metrics.settling_time_s;
        format!("rotation {}, position {}", seconds(times.rotation), seconds(times.position))
    };
    let sooner = |first: Option<f64>, second: Option<f64>| {
        first.is_some_and(|first| second.is_none_or(|second| first < second))
    };
    let errors = &diffc.metrics.joint_error_percent;
    let listed = errors.iter().map(|error| format!("{error:.2}")).collect::<Vec<_>>().join(", ");
    let (fast, slow) = (&diffc.metrics.settling_time_s, &decay.settling_time_s);
    let claim = |claim: String, holds, evidence| Claim { claim, holds, evidence };
    Ok(vec![
        claim(
            format!(
                "diffc with K = {} settles to 2 % of the final values in {} s",
                diffc.gain, diffc.duration
            ),
            errors.iter().all(|error| *error < 2.0),
            format!(
                "joints are {listed} % from their final values then: 1 to 3 have settled, the wrist has not all"
            ),
        ),
        claim(
            format!("diffc with logc's gain, K = {}, does not arrive", low.gain),
            low.metrics.settling_time_s.position.is_none(),
            format!("{:.0} mm from the goal after {} s", low.metrics.position_error_mm, low.duration),
        ),
        claim(
            "logc takes a less curved path than diffc".to_owned(),
            logc.metrics.path_ratio < diffc.metrics.path_ratio,
            format!(
                "path over straight line: logc {:.3}, diffc {:.3}",
                logc.metrics.path_ratio, diffc.metrics.path_ratio
            ),
        ),
        claim(
            "logc closes the translation before the rotation".to_owned(),
            sooner(slow.position, slow.rotation),
            format!(
                "with the decay rates of figure 4: {}; with equal gains the reverse: {}",
                order(&decay),
                order(&logc.metrics)
            ),
        ),
        claim(
            "diffc closes the rotation before the translation".to_owned(),
            sooner(fast.rotation, fast.position),
            order(&diffc.metrics),
        ),
        claim(
            "diffc overshoots its goal".to_owned(),
            diffc.metrics.overshoot_mm > 1.0,
            format!(
                "{:.1} mm past the goal along the line from the start; logc {:.1} mm",
                diffc.metrics.overshoot_mm, logc.metrics.overshoot_mm
            ),
        ),
    ])
}
