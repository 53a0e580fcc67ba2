//! The comparison in numbers: `compare.json`.

use super::summary::{ALL_ARMS, Cell, Summary};
use super::{Ageing, CompareError, Gain, HORIZON, Matched, PERIOD, StepTime, Study, ageing, step_times};
use crate::control::Law;
use serde::{Deserialize, Serialize};

/// Everything that the page and the tables show.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct Findings {
    /// Tasks for each arm.
    pub tasks: u32,
    /// Which tasks.
    pub seed: u64,
    /// The arms' names.
    pub arms: Vec<String>,
    /// The cycle of every loop \[s\].
    pub period_s: f64,
    /// A loop that has not settled by then has failed \[s\].
    pub horizon_s: f64,
    /// Each law's gains.
    pub gains: Vec<Gain>,
    /// All runs by cell, for each arm and for all of them.
    pub cells: Vec<Cell>,
    /// How old joint states may be.
    pub ageing: Vec<Ageing>,
    /// What a step costs.
    pub step_times: Vec<StepTime>,
}

impl Findings {
    /// Of a study and its runs.
    ///
    /// # Errors
    /// As the loops that try older joint states.
    pub fn new(study: &Study, summary: &Summary) -> Result<Self, CompareError> {
        Ok(Self {
            tasks: study.tasks,
            seed: study.seed,
            arms: study.arms.iter().map(|arm| arm.name.clone()).collect(),
            period_s: PERIOD.as_secs_f64(),
            horizon_s: HORIZON.as_secs_f64(),
            gains: study.gains.clone(),
            cells: summary.cells(),
            ageing: ageing(study)?,
            step_times: step_times(study)?,
        })
    }

    /// The cell of all arms.
    pub fn pooled(&self, matched: Matched, law: Law, limits: bool, plant: &str) -> Option<&Cell> {
        self.cells.iter().find(|cell| {
            let key = &cell.key;
            key.arm == ALL_ARMS
                && key.limits == limits
                && key.plant == plant
                && key.law == law.name()
                && key.matched == matched.name()
        })
    }

    /// The least and the greatest gain of a law on the arms [1/s].
    pub fn gain_range(&self, matched: Matched, law: Law) -> (f64, f64) {
        let gains = self.gains.iter().filter(|gain| gain.matched == matched && gain.law == law.name());
        gains.fold((f64::INFINITY, 0.0), |(low, high), gain| (low.min(gain.gain), high.max(gain.gain)))
    }

    /// Whether a law's gain was matched on every arm.
    pub fn is_matched(&self, matched: Matched, law: Law) -> bool {
        let mut gains = self.gains.iter().filter(|gain| gain.matched == matched && gain.law == law.name());
        gains.all(Gain::is_matched)
    }

    /// How old joint states may be for a law.
    pub fn ageing(&self, law: Law, limits: bool) -> Option<&Ageing> {
        self.ageing.iter().find(|ageing| ageing.law == law.name() && ageing.limits == limits)
    }

    /// Median time of a step \[ns\].
    pub fn step_ns(&self, law: Law) -> Option<f64> {
        self.step_times.iter().find(|time| time.law == law.name()).map(|time| time.ns[0])
    }
}
