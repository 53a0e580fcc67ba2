//! Names and colours of curves: one for each law of each run.

use crate::{RecordedRun, Sample};
use dq_figures::{Color, law_color};
use dq_kinematics::control::Law;
use std::ops::Range;

/// A run with the looks of its curves.
pub(super) struct Drawn<'a> {
    pub run: &'a RecordedRun,
    /// One after the other in time.
    pub looks: Vec<Look>,
}

/// How a run is drawn while a law is in force.
pub(super) struct Look {
    pub name: String,
    pub color: Color,
    /// While the law is in force \[s\].
    pub time: Range<f64>,
}

/// Colours that are no law's.
const COLORS: [Color; 6] =
    [[170, 51, 119], [86, 180, 233], [230, 159, 0], [90, 90, 90], [148, 103, 189], [140, 86, 75]];

/// The laws' own colours where each law is one run's alone, else a colour for each law of each run.
pub(super) fn looks(runs: &[RecordedRun]) -> Vec<Drawn<'_>> {
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
        let look = |(law, time): (Option<String>, Range<f64>)| Look {
            color: color(number, &law),
            name: law.map_or_else(|| run.name.clone(), |law| format!("{}, {law}", run.name)),
            time,
        };
        periods(run).into_iter().map(look).collect()
    };
    runs.iter().enumerate().map(|(number, run)| Drawn { run, looks: drawn((number, run)) }).collect()
}

/// Each law of each run once; a run without any has one key all the same.
fn keys(runs: &[RecordedRun]) -> Vec<(usize, Option<String>)> {
    let of_run = |(number, run)| periods(run).into_iter().map(move |(law, _)| (number, law));
    each_once(runs.iter().enumerate().flat_map(of_run))
}

/// The laws of a run, and when each was in force: the first from the beginning, the last to the end. A law that is no motion's has no
/// look of its own, where there are motions.
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

impl Look {
    /// What of a curve is while the law is in force, with the first point of the next, so that curves do not break.
    pub fn part_of<'a, V>(&self, points: &'a [(f64, V)]) -> &'a [(f64, V)] {
        let index = |time: f64| points.partition_point(|(at, _)| *at < time);
        &points[index(self.time.start)..(index(self.time.end) + 1).min(points.len())]
    }
}

impl Drawn<'_> {
    /// The samples that each look is for, with the first one of the next, so that curves do not break.
    pub fn samples(&self) -> impl Iterator<Item = (&Look, &[Sample])> {
        let index = |time: f64| self.run.samples.partition_point(|sample| sample.time < time);
        self.looks.iter().map(move |look| {
            let end = (index(look.time.end) + 1).min(self.run.samples.len());
            (look, &self.run.samples[index(look.time.start)..end])
        })
    }

    /// The colour of what is the run's under any law.
    pub fn color(&self) -> Color {
        self.looks.first().map_or(COLORS[0], |look| look.color)
    }
}

/// Each of these once, where it came first.
pub fn each_once<T: PartialEq>(all: impl Iterator<Item = T>) -> Vec<T> {
    all.fold(Vec::new(), |mut known, one| {
        if !known.contains(&one) {
            known.push(one);
        }
        known
    })
}
