//! Names and colors of curves. Each law of each run has a curve.

use crate::{RecordedRun, Sample};
use dq_figures::{Color, law_color};
use dq_kinematics::control::Law;
use std::ops::Range;

/// A run with the styles of its curves.
pub(super) struct StyledRun<'a> {
    pub run: &'a RecordedRun,
    /// A style for each period in which one law is in force, the earliest first.
    pub styles: Vec<CurveStyle>,
}

/// The style of a run's curves during the time in which one law is in force.
pub(super) struct CurveStyle {
    pub name: String,
    pub color: Color,
    /// When the law is in force \[s\].
    pub time: Range<f64>,
}

/// Colors that do not stand for a law.
const COLORS: [Color; 6] =
    [[170, 51, 119], [86, 180, 233], [230, 159, 0], [90, 90, 90], [148, 103, 189], [140, 86, 75]];

/// Returns the runs with their styles. If each law occurs in one run only, its curve has the law's own color. Otherwise the curves of
/// each law in each run have one of [`COLORS`].
pub(super) fn styles(runs: &[RecordedRun]) -> Vec<StyledRun<'_>> {
    let keys = keys(runs);
    let laws: Vec<_> =
        keys.iter().filter_map(|(_, law)| law.as_deref()?.split(' ').next()?.parse::<Law>().ok()).collect();
    let alone = laws.iter().enumerate().all(|(i, law)| !laws[..i].contains(law));
    let by_law = laws.len() == keys.len() && alone;
    let color = |run: usize, law: &Option<String>| {
        let index = keys.iter().position(|key| (key.0, &key.1) == (run, law)).unwrap_or_default();
        if by_law { law_color(laws[index]) } else { COLORS[index % COLORS.len()] }
    };
    let drawn = |(number, run): (usize, &'_ RecordedRun)| {
        let style = |(law, time): (Option<String>, Range<f64>)| CurveStyle {
            color: color(number, &law),
            name: law.map_or_else(|| run.name.clone(), |law| format!("{}, {law}", run.name)),
            time,
        };
        periods(run).into_iter().map(style).collect()
    };
    runs.iter().enumerate().map(|(number, run)| StyledRun { run, styles: drawn((number, run)) }).collect()
}

/// Returns each law of each run once, with the index of the run. A run without any law has one entry, with `None`.
fn keys(runs: &[RecordedRun]) -> Vec<(usize, Option<String>)> {
    let of_run = |(number, run)| periods(run).into_iter().map(move |(law, _)| (number, law));
    each_once(runs.iter().enumerate().flat_map(of_run))
}

/// Returns the laws of a run, each with the time range \[s\] in which it was in force. The first range has no beginning, and the
/// last range has no end. If the run has motions, laws without a motion are left out.
fn periods(run: &RecordedRun) -> Vec<(Option<String>, Range<f64>)> {
    let moved = |(_, law): &&(f64, String)| {
        let mut of_motions = run.motions.iter().flat_map(|motion| motion.law.split(", "));
        run.motions.is_empty() || of_motions.any(|known| known == law)
    };
    let mut laws: Vec<_> = run.laws.iter().filter(moved).collect();
    laws.dedup_by(|next, before| next.1 == before.1);
    let start = |i: usize| if i == 0 { f64::NEG_INFINITY } else { laws[i].0 };
    let end = |i: usize| laws.get(i + 1).map_or(f64::INFINITY, |next| next.0);
    let periods: Vec<_> =
        laws.iter().enumerate().map(|(i, (_, law))| (Some(law.clone()), start(i)..end(i))).collect();
    if periods.is_empty() { vec![(None, f64::NEG_INFINITY..f64::INFINITY)] } else { periods }
}

impl CurveStyle {
    /// Returns the part of a curve during which the law is in force. Adds the point after this part, so that the curve does not break.
    pub fn part_of<'a, V>(&self, points: &'a [(f64, V)]) -> &'a [(f64, V)] {
        let index = |time: f64| points.partition_point(|(at, _)| *at < time);
        &points[index(self.time.start)..(index(self.time.end) + 1).min(points.len())]
    }
}

impl StyledRun<'_> {
    /// Yields each style with the samples in its time range. Adds the sample after this range, so that curves do not break.
    pub fn samples(&self) -> impl Iterator<Item = (&CurveStyle, &[Sample])> {
        let index = |time: f64| self.run.samples.partition_point(|sample| sample.time < time);
        self.styles.iter().map(move |style| {
            let end = (index(style.time.end) + 1).min(self.run.samples.len());
            (style, &self.run.samples[index(style.time.start)..end])
        })
    }

    /// Returns the color of curves that do not depend on the law.
    pub fn color(&self) -> Color {
        self.styles.first().map_or(COLORS[0], |style| style.color)
    }
}

/// Returns the distinct values in the order of their first occurrence.
pub fn each_once<T: PartialEq>(all: impl Iterator<Item = T>) -> Vec<T> {
    all.fold(Vec::new(), |mut known, one| {
        if !known.contains(&one) {
            known.push(one);
        }
        known
    })
}
