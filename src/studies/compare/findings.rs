//! The results of the comparison, as `compare.json` has them.

use super::conditions::FRESH;
use super::latency::ageing;
use super::matching::gain_range;
use super::pairs::{Comparison, Quantity, comparisons};
use super::summary::{Cell, Key, Summary, Z};
use super::unmatched::unmatched;
use super::{
    Ageing, CompareError, Gain, HORIZON, Matched, PERIOD, Peer, Peers, REFERENCE, Record, StepTime, Study,
    Unmatched, step_times,
};
use dq_kinematics::control::{Law, Map};
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
    /// The results of each cell. A cell has the runs of one law under the same conditions, on one arm or on all arms together.
    pub cells: Vec<Cell>,
    /// Pairwise comparisons of laws on the same tasks.
    pub comparisons: Vec<Comparison>,
    /// The results of other programs, and the results of the baseline on the tasks that these programs have run.
    pub peers: Vec<Peer>,
    /// How old joint states may be for each law.
    pub ageing: Vec<Ageing>,
    /// The computation time of one step of each law.
    pub step_times: Vec<StepTime>,
    /// One run of each cell. A later version of this program can repeat these runs, and check that the results are the same.
    pub samples: Vec<Record>,
}

impl Findings {
    /// Computes the findings of a study from its runs and from the runs of other programs.
    ///
    /// # Errors
    /// The first error of a simulated run. In practice, no simulated run fails.
    pub fn new(study: &Study, summary: &Summary, peers: &Peers) -> Result<Self, CompareError> {
        Ok(Self {
            tasks: study.tasks,
            seed: study.seed,
            period_s: PERIOD.as_secs_f64(),
            horizon_s: HORIZON.as_secs_f64(),
            gains: study.gains.clone(),
            unmatched: unmatched(study)?,
            cells: summary.cells(Z),
            comparisons: comparisons(study, summary, peers.comparisons()),
            peers: peers.cells(),
            ageing: ageing(study, summary)?,
            step_times: step_times(study)?,
            samples: study.sample()?,
            arms: study.arms.iter().map(|arm| arm.name.clone()).collect(),
        })
    }

    /// Returns the names of the laws.
    pub fn laws(&self) -> Vec<&str> {
        let mut laws: Vec<&str> = Vec::new();
        for gain in &self.gains {
            if !laws.contains(&&*gain.law) {
                laws.push(&gain.law);
            }
        }
        laws
    }

    /// Returns the law with which all other laws are compared: the reference law, or the first law if the findings do not have the
    /// reference law.
    pub fn baseline(&self) -> &str {
        let (laws, reference) = (self.laws(), REFERENCE.0.name());
        if laws.contains(&reference) { reference } else { laws.first().copied().unwrap_or(reference) }
    }

    /// Returns the cell with this key; `None` if the findings do not have it.
    pub fn cell(&self, key: &Key) -> Option<&Cell> {
        self.cells.iter().find(|cell| cell.key == *key)
    }

    /// Returns how the law of `key` differs from the law `other` under the conditions of `key`; `None` if the two were not compared.
    pub fn comparison(&self, quantity: Quantity, key: &Key, other: &str) -> Option<Comparison> {
        let of = |c: &&Comparison| {
            (c.quantity, c.matched.name(), &c.arm, c.limits)
                == (quantity, &*key.matched, &key.arm, key.limits)
        };
        let fresh = self.comparisons.iter().filter(|_| key.plant == FRESH).filter(of);
        let between = |a: &str, b: &str| fresh.clone().find(|c| c.laws[0] == a && c.laws[1] == b);
        between(&key.law, other).cloned().or_else(|| between(other, &key.law).map(Comparison::reversed))
    }

    /// Returns the smallest and the largest gain of a law on the arms [1/s].
    pub fn gain_range(&self, matched: Matched, law: &str) -> [f64; 2] {
        gain_range(&self.gains, matched, law)
    }

    /// Returns the largest percentage by which a gain misses its target, among the laws that convert twists to joint velocities with
    /// `map`. Returns `None` if one of these laws fails in more than half of the tasks, or if there is no such law.
    pub fn most_off(&self, matched: Matched, map: Map) -> Option<f64> {
        let is_meant = |law: &str| law.parse::<Law>().is_ok_and(|law| law.map() == map);
        let gains = self.gains.iter().filter(|gain| gain.matched == matched && is_meant(&gain.law));
        let off = gains.map(|gain| Some(100.0 * (gain.reached? / gain.target - 1.0).abs()));
        off.reduce(|one, other| Some(one?.max(other?))).flatten()
    }

    /// Returns whether the gains of a law reach their targets for the quantity `matched` within 2 % on every arm.
    pub fn is_matched(&self, matched: Matched, law: &str) -> bool {
        let mut gains = self.gains.iter().filter(|gain| gain.matched == matched && gain.law == law);
        gains.all(Gain::is_matched)
    }

    /// Returns how old joint states may be for a law, with or without the servo's `limits`. Returns `None` if the findings do not
    /// have this law.
    pub fn ageing(&self, law: &str, limits: bool) -> Option<&Ageing> {
        self.ageing.iter().find(|ageing| ageing.law == law && ageing.limits == limits)
    }

    /// Returns the median computation time of one step of a law \[ns\]; `None` if it was not measured.
    pub fn step_ns(&self, law: &str) -> Option<f64> {
        self.step_times.iter().find(|time| time.law == law).map(|time| time.ns[0])
    }
}
