//! The figures of the comparison.

use super::summary::{ALL_ARMS, Key, Summary};
use super::{Findings, Interval, Matched};
use dq_figures::{Axis, Figure, Panel, Series, chart, law_color, law_line};
use dq_kinematics::control::Law;
use std::ops::Range;

/// Largest number of points of a curve.
const POINTS: usize = 200;

/// Returns the figures. For each quantity that the gains make equal, there are two figures: without the servo's limits, and with
/// them. These figures show how the laws settle, and at what cost. The last figure shows how old joint states may be.
pub fn figures(findings: &Findings, summary: &Summary) -> Vec<Figure> {
    let conditions = Matched::ALL.into_iter().flat_map(|matched| [(matched, false), (matched, true)]);
    let figure = |(matched, limits)| distributions(findings, summary, matched, limits);
    conditions.map(figure).chain([latency(findings)]).collect()
}

/// Returns the figure of the distributions of settling time, path ratio, overshoot and peak speed.
fn distributions(findings: &Findings, summary: &Summary, matched: Matched, limits: bool) -> Figure {
    let (name, under) = if limits {
        ("compare_servo", "under the servo's limits")
    } else {
        ("compare_laws", "without limits")
    };
    let (suffix, equal) = match matched {
        Matched::SettlingTime => ("", "settling time"),
        Matched::PeakSpeed => ("_equal_speed", "peak speed"),
    };
    let panel = |title: &str, label: &str, is_logarithmic: bool, column: usize| {
        let law = |law: &str| sorted(summary, &Key::fresh(matched, law, ALL_ARMS, limits), column);
        let curves: Vec<_> = findings.laws().into_iter().map(|name| (name, law(name))).collect();
        let range = shown(curves.iter().map(|(_, (values, _))| values.as_slice()), is_logarithmic);
        let curves =
            curves.iter().filter_map(|(law, (values, of))| series(law, share_below(values, *of, range.end)));
        Panel {
            title: title.to_owned(),
            x: Axis { label: label.to_owned(), range: range.clone(), logarithmic: is_logarithmic },
            y: Axis::new("share of all tasks [%]", 0.0..100.0),
            series: curves.collect(),
            names_at_ends: true,
            ..Panel::default()
        }
    };
    let rows = [
        vec![
            panel("settled to 2 %", "settling time [s]", false, 0),
            panel("of those, path", "path length / straight line", true, 1),
        ],
        vec![
            panel("of those, overshoot", "overshoot [mm]", false, 2),
            panel("of those, speed", "peak joint speed [rad/s]", true, 4),
        ],
    ];
    let title = format!("The laws {under}, with gains for equal {equal}: fresh joint states");
    chart(&format!("{name}{suffix}"), &title, &rows)
}

/// Returns the values of a quantity for the settled tasks of a cell, in ascending order, and the number of all tasks of the cell.
/// `column` is the index of the quantity in a row of the summary.
fn sorted(summary: &Summary, key: &Key, column: usize) -> (Vec<f64>, usize) {
    let rows = summary.rows(key);
    let mut values: Vec<_> = rows.iter().flatten().map(|row| row[column]).filter(|v| v.is_finite()).collect();
    values.sort_by(f64::total_cmp);
    (values, rows.len())
}

/// Returns the range of an axis. For each law, the range contains all values except for the largest tenth. A logarithmic axis has
/// at most two decades.
fn shown<'a>(laws: impl Iterator<Item = &'a [f64]>, is_logarithmic: bool) -> Range<f64> {
    let (mut low, mut high) = (f64::INFINITY, 0.0_f64);
    for values in laws.filter(|values| !values.is_empty()) {
        low = low.min(values[0]);
        high = high.max(values[(values.len() - 1) * 9 / 10]);
    }
    match is_logarithmic {
        _ if high <= low => 0.0..1.0,
        true => low.max(0.01 * high) / 1.05..1.05 * high,
        false => low - 0.02 * (high - low)..high + 0.02 * (high - low),
    }
}

/// Returns the cumulative distribution of the values `sorted`, up to the value `end`. Each point has a value, and the percentage of
/// tasks with at most this value. `of` is the number of all tasks, so a failed task counts as a value beyond `end`.
fn share_below(sorted: &[f64], of: usize, end: f64) -> Vec<(f64, f64)> {
    let step = sorted.len().div_ceil(POINTS).max(1);
    let share = |count: usize| 100.0 * count as f64 / of.max(1) as f64;
    let points = sorted.iter().enumerate().step_by(step).map(|(i, value)| (*value, share(i + 1)));
    let last = sorted.last().map(|_| (end, share(sorted.partition_point(|value| *value <= end))));
    points.take_while(|point| point.0 <= end).chain(last).collect()
}

fn latency(findings: &Findings) -> Figure {
    let panel = |limits: bool, title: &str| {
        let ages = |law: &str| {
            findings.ageing(law, limits).map_or(&[][..], |ageing: &super::Ageing| &ageing.settled_percent)
        };
        let curve = |law: &str| {
            let points = ages(law).iter().map(|(age, Interval { value, .. })| (*age, *value));
            series(law, points.collect())
        };
        let all: Vec<_> = findings.laws().into_iter().flat_map(ages).collect();
        let of = |value: fn(&(f64, Interval)) -> f64| all.iter().map(move |point| value(point));
        let (oldest, least) = (of(|it| it.0).fold(5.0, f64::max), of(|it| it.1.value).fold(100.0, f64::min));
        let most = of(|it| it.1.value).fold(100.0, f64::max);
        Panel {
            title: title.to_owned(),
            x: Axis::logarithmic("age of the joint states [ms]", 4.8..1.05 * oldest),
            y: Axis::new("of the tasks that settle with fresh ones [%]", (least - 1.0).max(0.0)..most + 1.0),
            series: findings.laws().into_iter().filter_map(curve).collect(),
            names_at_ends: true,
            ..Panel::default()
        }
    };
    let rows = [vec![panel(false, "no limits"), panel(true, "the servo's limits")]];
    chart("compare_latency", "Old joint states, with gains for equal settling time", &rows)
}

/// Returns the curve of a law; `None` if there is no law with this name.
fn series(law: &str, points: Vec<(f64, f64)>) -> Option<Series> {
    let law: Law = law.parse().ok()?;
    Some(Series { name: law.name().to_owned(), color: law_color(law), line: law_line(law), points })
}
