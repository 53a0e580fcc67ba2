//! The lines of `compare.jsonl`.

use super::CompareError;
use super::arm::Arm;
use super::closed_loop::Result as Ended;
use super::conditions::Plant;
use super::matching::Matched;
use dq_kinematics::control::Law;
use serde::{Deserialize, Serialize};
use std::io::ErrorKind;
use std::path::Path;

/// One run of the comparison: a law on an arm under certain conditions.
#[derive(Clone, Copy)]
pub(super) struct Run<'a> {
    pub matched: Matched,
    pub law: Law,
    pub arm: &'a Arm,
    pub limits: bool,
    pub plant: Plant,
    pub task: u32,
    pub gain: f64,
}

/// A run and its result. Each line of `compare.jsonl` is a record.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct Record {
    /// The quantity that the gains make equal for all laws: settling_time or peak_speed.
    pub matched: String,
    /// The name of the law.
    pub law: String,
    /// The name of the arm.
    pub arm: String,
    /// Whether the servo's limits were on.
    pub limits: bool,
    /// The name of the plant.
    pub plant: String,
    /// The number of the task.
    pub task: u32,
    /// The gain of the law [1/s].
    pub gain: f64,
    /// How the run ended: settled, or the reason of the failure.
    pub outcome: String,
    /// The time from which the errors of position and rotation stay below 2 % of their initial values \[s\]; `None` if they do not.
    pub settling_s: Option<f64>,
    /// The tool's path length divided by the distance between the ends of the path; `None` if that distance is below a millimeter.
    pub path_ratio: Option<f64>,
    /// The overshoot past the goal, along the line from the start \[mm\].
    pub overshoot_mm: f64,
    /// The effort `∫|θ̇|² dt` [rad²/s].
    pub effort: f64,
    /// The largest joint speed [rad/s].
    pub peak_rad_s: f64,
}

impl Record {
    /// Creates the record of a run that ended as `ended`. Numbers have six digits, because further digits have no meaning.
    pub(super) fn new(run: &Run, ended: &Ended) -> Self {
        let figures = &ended.figures;
        Self {
            matched: run.matched.name().to_owned(),
            law: run.law.name().to_owned(),
            arm: run.arm.name.clone(),
            limits: run.limits,
            plant: run.plant.name.to_owned(),
            task: run.task,
            gain: six_digits(run.gain),
            outcome: ended.outcome.name().to_owned(),
            settling_s: ended.settled().map(six_digits),
            path_ratio: figures.path_ratio.map(six_digits),
            overshoot_mm: six_digits(1e3 * figures.overshoot),
            effort: six_digits(figures.effort),
            peak_rad_s: six_digits(figures.peak_joint_speed),
        }
    }

    /// Reads the records of runs that other programs have written into `file`. Returns an empty list if the file does not exist.
    ///
    /// # Errors
    /// [`CompareError::File`] or [`CompareError::Damaged`].
    pub(super) fn read_all(file: &Path) -> Result<Vec<Self>, CompareError> {
        let text = match std::fs::read_to_string(file) {
            Ok(text) => text,
            Err(why) if why.kind() == ErrorKind::NotFound => String::new(),
            Err(why) => return Err(CompareError::file(file, why)),
        };
        let record = |(line, record)| {
            serde_json::from_str(record).map_err(|_| CompareError::damaged(file, line as u64))
        };
        text.lines().enumerate().map(record).collect()
    }

    /// Returns whether this is a record of `run`. Does not check the result in the record.
    pub(super) fn is_of(&self, run: &Run) -> bool {
        let is =
            [(&self.matched, run.matched.name()), (&self.law, run.law.name()), (&self.arm, &run.arm.name)];
        is.into_iter().chain([(&self.plant, run.plant.name)]).all(|(name, of_run)| name == of_run)
            && (self.limits, self.task, self.gain) == (run.limits, run.task, six_digits(run.gain))
    }
}

fn six_digits(value: f64) -> f64 {
    // Formatting rounds to the nearest decimal. The text can always be parsed.
    format!("{value:.5e}").parse().unwrap_or(value)
}
