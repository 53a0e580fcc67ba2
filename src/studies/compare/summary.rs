//! Summarizes the runs, with confidence intervals.

use super::closed_loop::HORIZON;
use super::conditions::FRESH;
use super::record::Record;
use super::{CompareError, Matched, Outcome, Study};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// The 97.5 % quantile of the normal distribution, for 95 % confidence intervals.
pub(super) const Z: f64 = 1.959_964;

/// A value with its confidence interval.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Serialize)]
pub struct Interval {
    /// The value.
    pub value: f64,
    /// The lower end of the interval.
    pub low: f64,
    /// The upper end of the interval.
    pub high: f64,
}

impl Interval {
    /// Returns `count` as a percentage of `of`, with Wilson's score interval (1927). `z` is the quantile of the normal
    /// distribution.
    pub fn share(count: usize, of: usize, z: f64) -> Self {
        let (n, p) = (of.max(1) as f64, count as f64 / of.max(1) as f64);
        let center = (p + z * z / (2.0 * n)) / (1.0 + z * z / n);
        let half = z / (1.0 + z * z / n) * (p * (1.0 - p) / n + z * z / (4.0 * n * n)).sqrt();
        let percent = |share: f64| 100.0 * share.clamp(0.0, 1.0);
        Self { value: percent(p), low: percent(center - half), high: percent(center + half) }
    }

    /// Returns the median of `sorted` with its interval. The ends of the interval are the values at the ranks that a binomial
    /// distribution gives. The interval assumes nothing about the distribution of the values, and agrees with a bootstrap of the
    /// median. `None` for an empty list.
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

/// The conditions that all runs of a cell share.
#[derive(Clone, Debug, Deserialize, Eq, Ord, PartialEq, PartialOrd, Serialize)]
pub struct Key {
    /// The quantity that the gains make equal for all laws.
    pub matched: String,
    /// The name of the arm, or `all` for all arms together.
    pub arm: String,
    /// Whether the servo's limits were on.
    pub limits: bool,
    /// The name of the plant.
    pub plant: String,
    /// The name of the law.
    pub law: String,
}

impl Key {
    /// Creates the key of a law's runs under these conditions.
    pub fn new(matched: Matched, law: &str, arm: &str, limits: bool, plant: &str) -> Self {
        let [matched, law, arm, plant] = [matched.name(), law, arm, plant].map(str::to_owned);
        Self { matched, arm, limits, plant, law }
    }

    /// Creates the key of a law's runs whose joint states are exact and have no delay.
    pub fn fresh(matched: Matched, law: &str, arm: &str, limits: bool) -> Self {
        Self::new(matched, law, arm, limits, FRESH)
    }

    /// Creates the key of the cell to which `record` belongs. `arm` is the name of its arm, or [`ALL_ARMS`].
    pub(super) fn of(record: &Record, arm: &str) -> Self {
        let [matched, law, arm, plant] =
            [&record.matched, &record.law, arm, &record.plant].map(str::to_owned);
        Self { matched, arm, limits: record.limits, plant, law }
    }

    /// Returns whether `other` has the same conditions as this key, apart from the law. Then the runs of both cells are of the same
    /// tasks.
    fn is_beside(&self, other: &Self) -> bool {
        (&self.matched, &self.arm, self.limits, &self.plant)
            == (&other.matched, &other.arm, other.limits, &other.plant)
    }
}

/// The name that stands for all arms together.
pub const ALL_ARMS: &str = "all";

/// The results of all runs under the same conditions.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct Cell {
    /// The conditions that the runs share.
    #[serde(flatten)]
    pub key: Key,
    /// The number of runs.
    pub runs: usize,
    /// The percentage of runs that settled.
    pub settled_percent: Interval,
    /// The number of failed runs for each reason.
    pub failures: BTreeMap<String, usize>,
    /// The median settling time of all runs \[s\]. A run has settled when its errors stay below 2 % of their initial values. The
    /// settling time of a failed run counts as the horizon. If an end of the interval equals the horizon, the true end is beyond
    /// the horizon.
    pub settling_s: Option<Interval>,
    /// The number of tasks that settle under every law. The four medians below are computed from these tasks only. Laws under which
    /// fewer than half of the tasks settle are left out: in their cells, this number and the medians are `None`. If this number is
    /// 0, the medians are `None` too.
    pub common: Option<usize>,
    /// The median of the path length divided by the straight line.
    pub path_ratio: Option<Interval>,
    /// The median overshoot past the goal \[mm\].
    pub overshoot_mm: Option<Interval>,
    /// The median effort `∫|θ̇|² dt` [rad²/s].
    pub effort: Option<Interval>,
    /// The median peak joint speed [rad/s].
    pub peak_rad_s: Option<Interval>,
}

/// The metrics of a run that settled: settling time, path ratio (NaN if there is none), overshoot, effort, peak speed. Units are as
/// in [`Record`].
pub type Row = [f64; 5];

/// The runs of a cell in the order of tasks, with `None` for failed runs. For all arms together, they are in the order of arms,
/// then tasks.
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
            *self.failures.entry(record.outcome.clone()).or_default() += 1;
        }
        self.rows.push(row);
    }

    fn settled(&self) -> usize {
        self.rows.iter().flatten().count()
    }

    /// Returns whether at least half of the runs settled. Otherwise the medians of the settled runs cannot be compared fairly with
    /// those of other laws.
    fn settles_half(&self) -> bool {
        2 * self.settled() >= self.rows.len()
    }
}

/// All runs of a study, grouped into cells. A cell has the runs with the same [`Key`]: one law under the same conditions, on one
/// arm or on all arms together.
#[derive(Clone, Debug, Default)]
pub struct Summary {
    cells: BTreeMap<Key, CellRuns>,
}

impl Summary {
    /// Reads the runs in `compare.jsonl`.
    ///
    /// # Errors
    /// The errors of [`Study::read`].
    pub fn read(study: &Study, file: &Path) -> Result<Self, CompareError> {
        let mut summary = Self::default();
        study.read(file, |record| summary.add(&record))?;
        Ok(summary)
    }

    /// Adds a run to its arm's cell and to the cell of all arms together.
    fn add(&mut self, record: &Record) {
        for arm in [&*record.arm, ALL_ARMS] {
            self.add_to(Key::of(record, arm), record);
        }
    }

    /// Adds a run to a cell.
    pub(super) fn add_to(&mut self, key: Key, record: &Record) {
        self.cells.entry(key).or_default().add(record);
    }

    /// Sets the runs of a cell. The reasons of failed runs are not known.
    pub(super) fn set(&mut self, key: Key, rows: Vec<Option<Row>>) {
        self.cells.insert(key, CellRuns { rows, failures: BTreeMap::new() });
    }

    /// Returns the runs of a cell in the order of tasks; `None` for failed runs. The runs of any two laws are of the same tasks, in
    /// the same order.
    pub fn rows(&self, key: &Key) -> &[Option<Row>] {
        self.cells.get(key).map_or(&[], |cell| &cell.rows)
    }

    /// Returns, for each task of a cell, whether the task settles under every law. Ignores laws under which fewer than half of the
    /// tasks settle.
    pub fn common(&self, key: &Key) -> Vec<bool> {
        let mut common = vec![true; self.rows(key).len()];
        let beside = self.cells.iter().filter(|(other, cell)| key.is_beside(other) && cell.settles_half());
        for (_, cell) in beside {
            common.iter_mut().zip(&cell.rows).for_each(|(common, row)| *common &= row.is_some());
        }
        common
    }

    /// Returns the results of every cell. `z` is the quantile of the normal distribution for the intervals.
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

/// Returns the median of the finite values, with its interval; `None` if no value is finite.
fn median(values: impl Iterator<Item = f64>, z: f64) -> Option<Interval> {
    let mut values: Vec<_> = values.filter(|value| value.is_finite()).collect();
    values.sort_by(f64::total_cmp);
    Interval::median(&values, z)
}

impl Outcome {
    /// Yields the names of all outcomes except `settled`.
    pub fn failures() -> impl Iterator<Item = &'static str> {
        Self::NAMES.iter().copied().filter(|name| *name != Self::Settled.name())
    }
}
