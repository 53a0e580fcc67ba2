//! What the runs say together, with how sure that is.

use super::record::Record;
use super::{CompareError, Outcome, Study};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// The normal distribution's 97.5 %: intervals hold the truth in 95 of 100 studies.
const Z: f64 = 1.959_964;

/// A figure with its 95 % confidence interval.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Serialize)]
pub struct Interval {
    /// The figure.
    pub value: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

impl Interval {
    /// A share \[%\] of so many of so many, by Wilson's score interval (1927); `z` is the normal distribution's quantile.
    pub fn share(count: usize, of: usize, z: f64) -> Self {
        let (n, p) = (of.max(1) as f64, count as f64 / of.max(1) as f64);
        let center = (p + z * z / (2.0 * n)) / (1.0 + z * z / n);
        let half = z / (1.0 + z * z / n) * (p * (1.0 - p) / n + z * z / (4.0 * n * n)).sqrt();
        let percent = |share: f64| 100.0 * share.clamp(0.0, 1.0);
        Self { value: percent(p), low: percent(center - half), high: percent(center + half) }
    }

    /// The median of `sorted`, between the two of them whose ranks a binomial distribution gives: no assumption on how they are
    /// distributed (the interval that a bootstrap of the median comes to). None of nothing.
    pub fn median(sorted: &[f64], z: f64) -> Option<Self> {
        let n = sorted.len() as f64;
        let at =
            |rank: f64| sorted.get((rank.max(0.0) as usize).min(sorted.len().saturating_sub(1))).copied();
        let half = 0.5 * z * n.sqrt();
        Some(Self {
            value: at(0.5 * n)?,
            low: at((0.5 * n - half).floor())?,
            high: at((0.5 * n + half).ceil())?,
        })
    }
}

/// What all runs of a cell have in common.
#[derive(Clone, Debug, Deserialize, Eq, Ord, PartialEq, PartialOrd, Serialize)]
pub struct Key {
    /// What was made equal among the laws.
    pub matched: String,
    /// The law's name.
    pub law: String,
    /// The arm's name; `all` for all arms together.
    pub arm: String,
    /// Whether the servo's limits held.
    pub limits: bool,
    /// The plant's name.
    pub plant: String,
}

/// All arms together.
pub const ALL_ARMS: &str = "all";

/// The runs of a cell in figures. Medians are of the runs that settled.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct Cell {
    /// Which runs.
    #[serde(flatten)]
    pub key: Key,
    /// How many.
    pub runs: usize,
    /// How many of them settled \[%\].
    pub settled_percent: Interval,
    /// How many failed, by reason.
    pub failures: BTreeMap<String, usize>,
    /// To 2 % \[s\].
    pub settling_s: Option<Interval>,
    /// Path by straight line.
    pub path_ratio: Option<Interval>,
    /// Past the goal \[mm\].
    pub overshoot_mm: Option<Interval>,
    /// `∫|θ̇|² dt` [rad²/s].
    pub effort: Option<Interval>,
    /// Peak joint speed [rad/s].
    pub peak_rad_s: Option<Interval>,
}

/// The values of a cell's runs that settled, and what became of the others.
#[derive(Clone, Debug, Default)]
pub struct CellValues {
    runs: usize,
    failures: BTreeMap<String, usize>,
    /// Settling time, path ratio, overshoot, effort, peak speed: as in [`Record`].
    pub columns: [Vec<f64>; 5],
}

impl CellValues {
    fn add(&mut self, record: &Record) {
        self.runs += 1;
        let Some(settling) = record.settling_s else {
            *self.failures.entry(record.outcome.clone().into_owned()).or_default() += 1;
            return;
        };
        let row = [settling, record.path_ratio, record.overshoot_mm, record.effort, record.peak_rad_s];
        self.columns.iter_mut().zip(row).for_each(|(column, value)| column.push(value));
    }

    /// How many runs there are, settled or not.
    pub fn runs(&self) -> usize {
        self.runs
    }

    /// The runs in figures; `z` is the normal distribution's quantile for the intervals.
    pub fn cell(&self, key: &Key, z: f64) -> Cell {
        let median = |column: usize| Interval::median(&self.columns[column], z);
        Cell {
            key: key.clone(),
            runs: self.runs,
            settled_percent: Interval::share(self.columns[0].len(), self.runs, z),
            failures: self.failures.clone(),
            settling_s: median(0),
            path_ratio: median(1),
            overshoot_mm: median(2),
            effort: median(3),
            peak_rad_s: median(4),
        }
    }
}

/// All runs of a study, by cell.
#[derive(Clone, Debug, Default)]
pub struct Summary {
    /// Each cell's values, in order of size; also of all arms together.
    pub values: BTreeMap<Key, CellValues>,
}

impl Summary {
    /// Of the runs in `compare.jsonl`.
    ///
    /// # Errors
    /// As [`Study::read`].
    pub fn read(study: &Study, file: &Path) -> Result<Self, CompareError> {
        let mut summary = Self::default();
        study.read(file, |record| summary.add(&record))?;
        summary.sort();
        Ok(summary)
    }

    /// Adds a run to its cell and to that of all arms.
    fn add(&mut self, record: &Record) {
        for arm in [&*record.arm, ALL_ARMS] {
            let key = Key {
                matched: record.matched.clone().into_owned(),
                law: record.law.clone().into_owned(),
                arm: arm.to_owned(),
                limits: record.limits,
                plant: record.plant.clone().into_owned(),
            };
            self.values.entry(key).or_default().add(record);
        }
    }

    fn sort(&mut self) {
        let columns = self.values.values_mut().flat_map(|values| &mut values.columns);
        columns.for_each(|column| column.sort_by(f64::total_cmp));
    }

    /// Every cell in figures.
    pub fn cells(&self) -> Vec<Cell> {
        self.values.iter().map(|(key, values)| values.cell(key, Z)).collect()
    }
}

impl Outcome {
    /// The names of the ways to fail.
    pub fn failures() -> impl Iterator<Item = &'static str> {
        Self::NAMES.iter().copied().filter(|name| *name != Self::Settled.name())
    }
}
