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

/// The data for the page "What the laws do" and for its tables.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct Findings {
    /// The number of tasks per arm.
    pub tasks: u32,
    /// The seed of the tasks.
    pub seed: u64,
    /// The names of the arms.
    pub arms: Vec<String>,
    /// The control period of every loop \[s\].
    pub period_s: f64,
    /// The time after which a loop that has not settled counts as failed \[s\].
    pub horizon_s: f64,
    /// The gains of each law.
    pub gains: Vec<Gain>,
    /// The gains that miss their targets by more than 2 %, and the reasons.
    #[serde(default)]
    pub unmatched: Vec<Unmatched>,
    /// The results of each cell: of the runs of one law under the same conditions. There are cells for each arm, and for all arms
    /// together.
    pub cells: Vec<Cell>,
    /// Pairwise comparisons of laws on the same tasks.
    pub comparisons: Vec<Comparison>,
    /// The results of other programs and of the reference law on the first tasks of each arm.
    pub peers: Vec<Peer>,
    /// How old joint states may be for each law.
    pub ageing: Vec<Ageing>,
    /// The time of a step, for each law.
    pub step_times: Vec<StepTime>,
    /// One run of each cell. A later version of this program can compare its results with these runs.
    pub samples: Vec<Record<'static>>,
}

impl Findings {
    /// Computes the findings of a study from its runs and from the runs of other programs.
    ///
    /// # Errors
    /// The first error of a simulated run with older joint states. In practice, no simulated run fails.
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

    /// Returns the results of a law on `arm`, which may also be `all`; `None` if the findings do not have this cell.
    pub fn cell(&self, matched: Matched, law: Law, arm: &str, limits: bool, plant: &str) -> Option<&Cell> {
        let key = Key::new(matched, law, arm, limits, plant);
        self.cells.iter().find(|cell| cell.key == key)
    }

    /// Returns how the law with the name `law` differs from `other`; `None` if the two were not compared.
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

    /// Returns the smallest and the largest gain of a law on the arms [1/s].
    pub fn gain_range(&self, matched: Matched, law: Law) -> (f64, f64) {
        let gains = self.gains.iter().filter(|gain| gain.matched == matched && gain.law == law.name());
        gains.fold((f64::INFINITY, 0.0), |(low, high), gain| (low.min(gain.gain), high.max(gain.gain)))
    }

    /// Returns the largest percentage by which the gains of these laws miss their targets. Returns `None` if one of these laws
    /// fails in more than half of the tasks.
    pub fn most_off(&self, matched: Matched, of: impl Fn(Law) -> bool) -> Option<f64> {
        let laws: Vec<_> = Law::all().filter(|law| of(*law)).map(|law| law.name()).collect();
        let mut gains =
            self.gains.iter().filter(|gain| gain.matched == matched && laws.contains(&&*gain.law));
        gains.try_fold(0.0, |most: f64, gain| {
            Some(most.max(100.0 * (gain.reached? / gain.target - 1.0).abs()))
        })
    }

    /// Returns whether the gain of a law is matched on every arm.
    pub fn is_matched(&self, matched: Matched, law: Law) -> bool {
        let mut gains = self.gains.iter().filter(|gain| gain.matched == matched && gain.law == law.name());
        gains.all(Gain::is_matched)
    }

    /// Returns how old joint states may be for a law; `None` if the findings do not have this law.
    pub fn ageing(&self, law: Law, limits: bool) -> Option<&Ageing> {
        self.ageing.iter().find(|ageing| ageing.law == law.name() && ageing.limits == limits)
    }

    /// Returns the median time of a step \[ns\]; `None` if it was not measured.
    pub fn step_ns(&self, law: Law) -> Option<f64> {
        self.step_times.iter().find(|time| time.law == law.name()).map(|time| time.ns[0])
    }
}
