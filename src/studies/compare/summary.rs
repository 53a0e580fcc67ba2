//! What the runs say together, with how sure that is.

use super::closed_loop::HORIZON;
use super::record::Record;
use super::{CompareError, Matched, Outcome, Study};
use dq_kinematics::control::Law;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// The normal distribution's 97.5 %: intervals hold the truth in 95 of 100 studies.
pub(super) const Z: f64 = 1.959_964;

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
    /// The arm's name; `all` for all arms together.
    pub arm: String,
    /// Whether the servo's limits held.
    pub limits: bool,
    /// The plant's name.
    pub plant: String,
    /// The law's name.
    pub law: String,
}

impl Key {
    /// Of these runs.
    pub fn new(matched: Matched, law: Law, arm: &str, limits: bool, plant: &str) -> Self {
        let (matched, law) = (matched.name().to_owned(), law.name().to_owned());
        Self { matched, arm: arm.to_owned(), limits, plant: plant.to_owned(), law }
    }

    /// Of that run, on `arm`, which may be all arms together.
    pub(super) fn of(record: &Record, arm: &str) -> Self {
        Self {
            matched: record.matched.clone().into_owned(),
            arm: arm.to_owned(),
            limits: record.limits,
            plant: record.plant.clone().into_owned(),
            law: record.law.clone().into_owned(),
        }
    }

    /// Whether the other's runs are those of another law on the same tasks.
    fn is_beside(&self, other: &Self) -> bool {
        (&self.matched, &self.arm, self.limits, &self.plant)
            == (&other.matched, &other.arm, other.limits, &other.plant)
    }
}

/// All arms together.
pub const ALL_ARMS: &str = "all";

/// The runs of a cell in figures.
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
    /// To 2 % \[s\]: the median of all runs, of which one that failed settles later than the horizon. Where an end of the interval is the
    /// horizon, it lies later.
    pub settling_s: Option<Interval>,
    /// On how many tasks the figures below are: those that each law settles which settles at least half of them. None for a law that
    /// settles fewer.
    pub common: Option<usize>,
    /// Path by straight line.
    pub path_ratio: Option<Interval>,
    /// Past the goal \[mm\].
    pub overshoot_mm: Option<Interval>,
    /// `∫|θ̇|² dt` [rad²/s].
    pub effort: Option<Interval>,
    /// Peak joint speed [rad/s].
    pub peak_rad_s: Option<Interval>,
}

/// A run that settled: settling time, path ratio (not a number where there is none), overshoot, effort, peak speed, as in [`Record`].
pub type Row = [f64; 5];

/// A cell's runs, task after task, on all arms together arm after arm: none for those that failed.
#[derive(Clone, Debug, Default)]
struct CellRuns {
    rows: Vec<Option<Row>>,
    failures: BTreeMap<String, usize>,
}

impl CellRuns {
    fn add(&mut self, record: &Record) {
        let row = record.settling_s.map(|settling| {
            let path_ratio = record.path_ratio.unwrap_or(f64::NAN);
            [settling, path_ratio, record.overshoot_mm, record.effort, record.peak_rad_s]
        });
        if row.is_none() {
            *self.failures.entry(record.outcome.clone().into_owned()).or_default() += 1;
        }
        self.rows.push(row);
    }

    fn settled(&self) -> usize {
        self.rows.iter().flatten().count()
    }

    /// Whether a comparison of figures is not one of a few survivors.
    fn settles_half(&self) -> bool {
        2 * self.settled() >= self.rows.len()
    }
}

/// All runs of a study, by cell; also of all arms together.
#[derive(Clone, Debug, Default)]
pub struct Summary {
    cells: BTreeMap<Key, CellRuns>,
}

impl Summary {
    /// Of the runs in `compare.jsonl`.
    ///
    /// # Errors
    /// As [`Study::read`].
    pub fn read(study: &Study, file: &Path) -> Result<Self, CompareError> {
        let mut summary = Self::default();
        study.read(file, |record| summary.add(&record))?;
        Ok(summary)
    }

    /// Adds a run to its cell and to that of all arms.
    fn add(&mut self, record: &Record) {
        for arm in [&*record.arm, ALL_ARMS] {
            self.add_to(Key::of(record, arm), record);
        }
    }

    /// Adds a run to a cell.
    pub(super) fn add_to(&mut self, key: Key, record: &Record) {
        self.cells.entry(key).or_default().add(record);
    }

    /// Makes these the runs of a cell, whatever the reasons of those that failed.
    pub(super) fn set(&mut self, key: Key, rows: Vec<Option<Row>>) {
        self.cells.insert(key, CellRuns { rows, failures: BTreeMap::new() });
    }

    /// The runs of a cell, task after task: none for those that failed. Two laws' rows are of the same tasks.
    pub fn rows(&self, key: &Key) -> &[Option<Row>] {
        self.cells.get(key).map_or(&[], |cell| &cell.rows)
    }

    /// Of the tasks of a cell those that each law settles which settles at least half of them.
    pub fn common(&self, key: &Key) -> Vec<bool> {
        let mut common = vec![true; self.rows(key).len()];
        let beside = self.cells.iter().filter(|(other, cell)| key.is_beside(other) && cell.settles_half());
        for (_, cell) in beside {
            common.iter_mut().zip(&cell.rows).for_each(|(common, row)| *common &= row.is_some());
        }
        common
    }

    /// Every cell in figures; `z` is the normal distribution's quantile for the intervals.
    pub fn cells(&self, z: f64) -> Vec<Cell> {
        self.cells.iter().map(|(key, runs)| self.cell(key, runs, z)).collect()
    }

    fn cell(&self, key: &Key, runs: &CellRuns, z: f64) -> Cell {
        let common = runs.settles_half().then(|| self.common(key));
        let of_common = |column: usize| {
            let rows = runs.rows.iter().zip(common.as_ref()?).filter(|(_, common)| **common);
            median(rows.filter_map(|(row, _)| Some((*row)?[column])), z)
        };
        Cell {
            key: key.clone(),
            runs: runs.rows.len(),
            settled_percent: Interval::share(runs.settled(), runs.rows.len(), z),
            failures: runs.failures.clone(),
            settling_s: median(
                runs.rows.iter().map(|row| row.map_or(HORIZON.as_secs_f64(), |row| row[0])),
                z,
            ),
            common: common.as_ref().map(|common| common.iter().filter(|common| **common).count()),
            path_ratio: of_common(1),
            overshoot_mm: of_common(2),
            effort: of_common(3),
            peak_rad_s: of_common(4),
        }
    }
}

/// The median of those that are numbers.
fn median(values: impl Iterator<Item = f64>, z: f64) -> Option<Interval> {
    let mut values: Vec<_> = values.filter(|value| value.is_finite()).collect();
    values.sort_by(f64::total_cmp);
    Interval::median(&values, z)
}

impl Outcome {
    /// The names of the ways to fail.
    pub fn failures() -> impl Iterator<Item = &'static str> {
        Self::NAMES.iter().copied().filter(|name| *name != Self::Settled.name())
    }
}
