//! Compares two laws on the same tasks, task by task.

use dq_common::named;
use serde::{Deserialize, Serialize};
use statrs::distribution::{Binomial, DiscreteCDF};

use super::summary::{Interval, Key, Row, Summary, Z};
use super::{ALL_ARMS, Matched, Study};

named! {
    /// A quantity in which two laws are compared.
    #[derive(Deserialize, Serialize)]
    #[serde(rename_all = "snake_case")]
    "quantity" Quantity {
        /// The percentage of tasks that settle.
        Settled = "settled",
        /// The settling time to 2 % \[s\].
        SettlingTime = "settling_time",
        /// The path length divided by the straight line.
        PathRatio = "path_ratio",
        /// The overshoot \[mm\].
        Overshoot = "overshoot",
        /// The effort `∫|θ̇|² dt` [rad²/s].
        Effort = "effort",
        /// The peak joint speed [rad/s].
        PeakSpeed = "peak_speed",
    }
}

/// The quantities that are compared only on tasks that settle under both laws, in the order of a row's columns.
pub(super) const FIGURES: [Quantity; 5] =
    [Quantity::SettlingTime, Quantity::PathRatio, Quantity::Overshoot, Quantity::Effort, Quantity::PeakSpeed];

/// The comparison of two laws in one quantity. The joint states are exact and have no delay.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct Comparison {
    /// The quantity that is compared.
    pub quantity: Quantity,
    /// The quantity that the gains make equal for all laws.
    pub matched: Matched,
    /// The name of the arm, or `all`.
    pub arm: String,
    /// Whether the servo's limits were on.
    pub limits: bool,
    /// The names of the two laws.
    pub laws: [String; 2],
    /// The number of tasks that are compared.
    pub pairs: usize,
    /// The number of tasks on which the first law has the larger value, and the number on which the second law has the larger
    /// value.
    pub more: [usize; 2],
    /// The first law's value minus the second law's value. For percentages, it is in percentage points; for the other quantities,
    /// it is the median of the differences over the tasks.
    pub difference: Interval,
    /// The probability that chance alone makes the two numbers in `more` at least as different as they are.
    pub p: f64,
    /// The probability `p`, adjusted by Holm (1979) for all comparisons. If it is below 0.05, the laws differ significantly.
    pub p_holm: f64,
}

/// The level of significance: the largest allowed probability to report a difference between laws that do not differ.
const TOLD: f64 = 0.05;

impl Comparison {
    /// Returns whether the two laws differ significantly, both by the test and by the interval.
    pub fn tells(&self) -> bool {
        self.p_holm < TOLD && (self.difference.low > 0.0 || self.difference.high < 0.0)
    }

    /// Returns the comparison with the two laws exchanged.
    #[must_use]
    pub fn reversed(&self) -> Self {
        let Interval { value, low, high } = self.difference;
        let [first, second] = self.laws.clone();
        Self {
            laws: [second, first],
            more: [self.more[1], self.more[0]],
            difference: Interval { value: 0.0 - value, low: 0.0 - high, high: 0.0 - low },
            ..self.clone()
        }
    }
}

/// Returns the probability that `a + b` tosses of a coin split at least as unevenly as `a` and `b` (the exact sign test). If `a`
/// and `b` are the numbers of pairs in which only the first or only the second member has a property, this is the exact test of
/// McNemar (1947).
pub fn sign_test(a: usize, b: usize) -> f64 {
    // One half is a valid probability, so the distribution always exists.
    Binomial::new(0.5, (a + b) as u64).map_or(1.0, |tosses| (2.0 * tosses.cdf(a.min(b) as u64)).min(1.0))
}

/// Returns the probabilities `p` of several tests, corrected for the number of tests (Holm 1979).
pub fn holm(p: &[f64]) -> Vec<f64> {
    let mut order: Vec<_> = (0..p.len()).collect();
    order.sort_by(|i, j| p[*i].total_cmp(&p[*j]));
    let (mut adjusted, mut largest) = (vec![1.0; p.len()], 0.0_f64);
    for (rank, index) in order.into_iter().enumerate() {
        largest = largest.max((p.len() - rank) as f64 * p[index]).min(1.0);
        adjusted[index] = largest;
    }
    adjusted
}

impl Interval {
    /// Compares how often the first and the second members of `pairs` pairs have a property. Returns the percentage of the first
    /// members that have it, minus the percentage of the second members \[percentage points\].
    ///
    /// Only the first member has the property in `first` pairs, and only the second member in `second` pairs. `z` is the quantile of
    /// the normal distribution. The interval is Wald's, with half a pair added to each cell of the 2×2 table (Agresti & Min 2005).
    pub fn paired_share(first: usize, second: usize, pairs: usize, z: f64) -> Self {
        let (b, c, n) = (first as f64 + 0.5, second as f64 + 0.5, pairs as f64 + 2.0);
        let (center, half) = ((b - c) / n, z * (b + c - (b - c).powi(2) / n).max(0.0).sqrt() / n);
        let value = (first as f64 - second as f64) / pairs.max(1) as f64;
        let points = |part: f64| 100.0 * part.clamp(-1.0, 1.0);
        Self { value: points(value), low: points(center - half), high: points(center + half) }
    }
}

/// Makes all comparisons, without and with the servo's limits:
///
/// - every pair of laws on all arms together, with gains for equal settling time,
/// - each law and the study's [baseline](Study::baseline) on all arms together, with gains for equal peak speed,
/// - each law and the baseline on each arm, with gains for equal settling time: only the percentage of tasks that settle.
///
/// Adds the comparisons `more`, and adjusts the probabilities of all comparisons together.
pub(super) fn comparisons(study: &Study, summary: &Summary, more: Vec<Comparison>) -> Vec<Comparison> {
    let (laws, baseline) = (&study.laws, study.baseline());
    let all_quantities = [&[Quantity::Settled][..], &FIGURES].concat();
    let with_baseline: Vec<_> =
        laws.iter().filter(|law| **law != baseline).map(|law| [law.name(), baseline.name()]).collect();
    let pairs = laws
        .iter()
        .enumerate()
        .flat_map(|(i, first)| laws[i + 1..].iter().map(move |second| [first.name(), second.name()]));
    let pairs: Vec<_> = pairs.collect();
    let mut all = Vec::new();
    for limits in [false, true] {
        let mut add = |matched: Matched, arm: &str, pairs: &[[&str; 2]], quantities: &[Quantity]| {
            for laws in pairs {
                let keys = laws.map(|law| Key::fresh(matched, law, arm, limits));
                let both = keys.each_ref().map(|key| (key, summary.rows(key)));
                all.extend(quantities.iter().filter_map(|quantity| compared(*quantity, matched, both)));
            }
        };
        add(Matched::SettlingTime, ALL_ARMS, &pairs, &all_quantities);
        add(Matched::PeakSpeed, ALL_ARMS, &with_baseline, &all_quantities);
        for arm in &study.arms {
            add(Matched::SettlingTime, &arm.name, &with_baseline, &[Quantity::Settled]);
        }
    }
    all.extend(more);
    let adjusted = holm(&all.iter().map(|comparison| comparison.p).collect::<Vec<_>>());
    all.iter_mut().zip(adjusted).for_each(|(comparison, p)| comparison.p_holm = p);
    all
}

/// Compares two laws on the same tasks. Does not adjust the probability for other comparisons. Returns `None` if there are no tasks
/// to compare.
pub(super) fn compared(
    quantity: Quantity,
    matched: Matched,
    [(key, first), (other, second)]: [(&Key, &[Option<Row>]); 2],
) -> Option<Comparison> {
    let (pairs, more, difference) = compare(quantity, first, second)?;
    let (p, laws) = (sign_test(more[0], more[1]), [key.law.clone(), other.law.clone()]);
    let (arm, limits) = (key.arm.clone(), key.limits);
    Some(Comparison { quantity, matched, arm, limits, laws, pairs, more, difference, p, p_holm: 1.0 })
}

/// Compares two laws task by task. Returns [`Comparison::pairs`], [`Comparison::more`] and [`Comparison::difference`].
///
/// [`Quantity::Settled`] is compared on all tasks, any other quantity on the tasks that settle under both laws. Returns `None` if
/// there are no such tasks.
fn compare(
    quantity: Quantity,
    first: &[Option<Row>],
    second: &[Option<Row>],
) -> Option<(usize, [usize; 2], Interval)> {
    let pairs = || first.iter().zip(second);
    let Some(column) = FIGURES.iter().position(|figure| *figure == quantity) else {
        let only = |a: fn(&(&Option<Row>, &Option<Row>)) -> bool| pairs().filter(a).count();
        let more = [only(|(a, b)| a.is_some() && b.is_none()), only(|(a, b)| a.is_none() && b.is_some())];
        let count = pairs().count();
        return (count > 0).then(|| (count, more, Interval::paired_share(more[0], more[1], count, Z)));
    };
    let difference = |(a, b): (&Option<Row>, &Option<Row>)| Some(a.as_ref()?[column] - b.as_ref()?[column]);
    let mut differences: Vec<_> = pairs().filter_map(difference).filter(|d| d.is_finite()).collect();
    differences.sort_by(f64::total_cmp);
    let count = |is: fn(&f64) -> bool| differences.iter().filter(|d| is(d)).count();
    let more = [count(|d| *d > 0.0), count(|d| *d < 0.0)];
    Some((differences.len(), more, Interval::median(&differences, Z)?))
}
