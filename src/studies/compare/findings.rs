//! The comparison in numbers: `compare.json`.

use super::latency::ageing;
use super::pairs::{Comparison, Quantity, comparisons};
use super::summary::{Cell, Key, Summary, Z};
use super::unmatched::unmatched;
use super::{
    Ageing, CompareError, Gain, HORIZON, Matched, PERIOD, Peer, Peers, Record, StepTime, Study, Unmatched,
    step_times,
};
use dq_kinematics::control::Law;
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
    /// The gains that miss their targets by more than 2 %, and why.
    #[serde(default)]
    pub unmatched: Vec<Unmatched>,
    /// All runs by cell, for each arm and for all of them.
    pub cells: Vec<Cell>,
    /// Laws two by two on the same tasks.
    pub comparisons: Vec<Comparison>,
    /// Other programs on the first tasks of each arm, beside the reference law.
    pub peers: Vec<Peer>,
    /// How old joint states may be.
    pub ageing: Vec<Ageing>,
    /// What a step costs.
    pub step_times: Vec<StepTime>,
    /// One run of each cell, to see whether a program still does the same.
    pub samples: Vec<Record<'static>>,
}

impl Findings {
    /// Of a study, its runs, and those of other programs.
    ///
    /// # Errors
    /// As the loops that try older joint states.
    pub fn new(study: &Study, summary: &Summary, peers: &Peers) -> Result<Self, CompareError> {
        let arms: Vec<_> = study.arms.iter().map(|arm| arm.name.clone()).collect();
        Ok(Self {
            tasks: study.tasks,
            seed: study.seed,
            period_s: PERIOD.as_secs_f64(),
            horizon_s: HORIZON.as_secs_f64(),
            gains: study.gains.clone(),
            unmatched: unmatched(study)?,
            cells: summary.cells(Z),
            comparisons: comparisons(summary, &arms, peers.comparisons()),
            peers: peers.cells(),
            ageing: ageing(study, summary)?,
            step_times: step_times(study)?,
            samples: study.sample()?.into_iter().map(Record::into_owned).collect(),
            arms,
        })
    }

    /// The runs of a law on an arm, or on all of them.
    pub fn cell(&self, matched: Matched, law: Law, arm: &str, limits: bool, plant: &str) -> Option<&Cell> {
        let key = Key::new(matched, law, arm, limits, plant);
        self.cells.iter().find(|cell| cell.key == key)
    }

    /// How the law of the name `law` differs from `other` in what was compared of the two.
    pub fn comparison(
        &self,
        quantity: Quantity,
        matched: Matched,
        arm: &str,
        limits: bool,
        law: &str,
        other: &str,
    ) -> Option<Comparison> {
        let of =
            |c: &&Comparison| (c.quantity, c.matched, &*c.arm, c.limits) == (quantity, matched, arm, limits);
        let between =
            |a: &str, b: &str| self.comparisons.iter().filter(of).find(|c| c.laws[0] == a && c.laws[1] == b);
        between(law, other).cloned().or_else(|| between(other, law).map(Comparison::reversed))
    }

    /// The least and the greatest gain of a law on the arms [1/s].
    pub fn gain_range(&self, matched: Matched, law: Law) -> (f64, f64) {
        let gains = self.gains.iter().filter(|gain| gain.matched == matched && gain.law == law.name());
        gains.fold((f64::INFINITY, 0.0), |(low, high), gain| (low.min(gain.gain), high.max(gain.gain)))
    }

    /// By how much \[%\] the gains of these laws miss their targets at most; none where a law fails more than half of the tasks.
    pub fn most_off(&self, matched: Matched, of: impl Fn(Law) -> bool) -> Option<f64> {
        let laws: Vec<_> = Law::all().filter(|law| of(*law)).map(|law| law.name()).collect();
        let mut gains =
            self.gains.iter().filter(|gain| gain.matched == matched && laws.contains(&&*gain.law));
        gains.try_fold(0.0, |most: f64, gain| {
            Some(most.max(100.0 * (gain.reached? / gain.target - 1.0).abs()))
        })
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
