//! The sweep in numbers.

use super::{LAWS, Outcome, Pair};
use crate::control::Law;
use crate::paper::Laboratory;
use serde::Serialize;

/// A law over all tasks.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LawSummary {
    /// The law's name.
    pub law: &'static str,
    /// Its gain [1/s].
    pub gain: f64,
    /// Tasks that did not settle in the time given.
    pub failures: usize,
    /// Their share of all tasks \[%\].
    pub failures_percent: f64,
    /// Settling times below which 10 %, 50 % and 90 % of the tasks that settled are.
    #[serde(rename = "settling_time_2_percent_s")]
    pub settling_time: [f64; 3],
    /// Path ratios below which 10 %, 50 % and 90 % of the tasks that settled are.
    pub path_ratio: [f64; 3],
    /// Peak speeds below which 10 %, 50 % and 90 % of the tasks that settled are.
    #[serde(rename = "peak_joint_speed_rad_s")]
    pub peak_joint_speed: [f64; 3],
}

/// Who wins among tasks of like angle.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Bin {
    /// The least and the largest angle between start and goal \[°\].
    pub angle_deg: [f64; 2],
    /// Number of tasks between these angles.
    pub pairs: usize,
    /// Share of tasks at which each law failed \[%\], in the order of the laws.
    pub failures_percent: [f64; 3],
    /// Share of tasks that each law settled first \[%\].
    pub fastest_percent: [f64; 3],
    /// Share of tasks that each law settled on the shortest path \[%\].
    pub shortest_percent: [f64; 3],
    /// Share of tasks that each law settled with the lowest peak speed \[%\].
    pub gentlest_percent: [f64; 3],
}

/// The sweep in numbers.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SweepSummary {
    /// Number of tasks.
    pub pairs: usize,
    /// Seed of the random numbers that make the tasks.
    pub seed: u64,
    /// Time given to each task \[s\].
    pub duration_s: f64,
    /// The laws over all tasks.
    pub laws: Vec<LawSummary>,
    /// The laws over tasks of like angle.
    pub by_angle: Vec<Bin>,
}

impl SweepSummary {
    /// The summary of these outcomes.
    pub fn new(lab: &Laboratory, pairs: &[Pair]) -> Self {
        let constants = lab.experiment.sweep;
        let laws = LAWS.iter().enumerate().map(|(i, law)| summarize(lab, *law, i, pairs)).collect();
        let by_angle = (0..BINS).map(|bin| Bin::new(bin, pairs)).collect();
        Self { pairs: pairs.len(), seed: constants.seed, duration_s: constants.duration, laws, by_angle }
    }
}

fn summarize(lab: &Laboratory, law: Law, index: usize, pairs: &[Pair]) -> LawSummary {
    let failures = pairs.iter().filter(|pair| pair.outcomes[index].settling_time.is_none()).count();
    let quantiles = |value: fn(&Outcome) -> f64| {
        let values = settled(pairs, index, value);
        [0.1, 0.5, 0.9].map(|part| quantile(&values, part))
    };
    LawSummary {
        law: law.name(),
        gain: lab.gain(law),
        failures,
        failures_percent: percent(failures, pairs.len()),
        settling_time: quantiles(|outcome| outcome.settling_time.unwrap_or_default()),
        path_ratio: quantiles(|outcome| outcome.path_ratio),
        peak_joint_speed: quantiles(|outcome| outcome.peak_joint_speed),
    }
}

/// The values of the tasks that a law settled, in order of size.
pub(super) fn settled(pairs: &[Pair], law: usize, value: fn(&Outcome) -> f64) -> Vec<f64> {
    let outcomes = pairs.iter().map(|pair| &pair.outcomes[law]);
    let mut values: Vec<_> = outcomes.filter(|outcome| outcome.settling_time.is_some()).map(value).collect();
    values.sort_by(f64::total_cmp);
    values
}

fn quantile(sorted: &[f64], part: f64) -> f64 {
    let index = (part * sorted.len() as f64) as usize;
    sorted.get(index.min(sorted.len().saturating_sub(1))).copied().unwrap_or(f64::NAN)
}

pub(super) fn percent(count: usize, of: usize) -> f64 {
    if of == 0 { 0.0 } else { 100.0 * count as f64 / of as f64 }
}

/// Angles between start and goal are sorted into this many bins, up to 180°.
const BINS: usize = 6;

impl Bin {
    fn new(bin: usize, pairs: &[Pair]) -> Self {
        let width = 180.0 / BINS as f64;
        let range = [bin as f64 * width, (bin + 1) as f64 * width];
        let inside = |pair: &&Pair| (pair.angle_deg / width).min(BINS as f64 - 1.0) as usize == bin;
        let inside: Vec<_> = pairs.iter().filter(inside).collect();
        let share = |counts: [usize; 3]| counts.map(|count| percent(count, inside.len()));
        let failed =
            |law: usize| inside.iter().filter(|pair| pair.outcomes[law].settling_time.is_none()).count();
        let won = |value: fn(&Outcome) -> f64| {
            let mut wins = [0; 3];
            inside.iter().filter_map(|pair| best(pair, value)).for_each(|law| wins[law] += 1);
            share(wins)
        };
        Self {
            angle_deg: range,
            pairs: inside.len(),
            failures_percent: share(std::array::from_fn(failed)),
            fastest_percent: won(|outcome| outcome.settling_time.unwrap_or(f64::INFINITY)),
            shortest_percent: won(|outcome| outcome.path_ratio),
            gentlest_percent: won(|outcome| outcome.peak_joint_speed),
        }
    }
}

/// The law with the least value among those that settled.
fn best(pair: &Pair, value: fn(&Outcome) -> f64) -> Option<usize> {
    let settled = pair.outcomes.iter().enumerate().filter(|(_, outcome)| outcome.settling_time.is_some());
    settled.min_by(|a, b| value(a.1).total_cmp(&value(b.1))).map(|(law, _)| law)
}
