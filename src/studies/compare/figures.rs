//! The figures of the comparison.

use super::summary::{ALL_ARMS, Key, Summary};
use super::{Findings, Matched};
use dq_figures::{Axis, Figure, Line, Panel, Series, chart, law_color};
use dq_kinematics::control::{Law, Map};

/// Largest number of points of a curve.
const POINTS: usize = 200;

/// Returns the figures: how laws settle, at what cost, and how old joint states may be.
pub fn figures(findings: &Findings, summary: &Summary) -> [Figure; 3] {
    [
        distributions("compare_laws", "The laws themselves: fresh joint states, no limits", summary, false),
        distributions(
            "compare_servo",
            "The laws under the servo's limits: fresh joint states",
            summary,
            true,
        ),
        latency(findings),
    ]
}

/// Returns the figure `name` of distributions, with one column of panels for each matched quantity.
fn distributions(name: &str, title: &str, summary: &Summary, limits: bool) -> Figure {
    let row = |what: &str, x: Axis, column: usize| {
        let panel = |matched| {
            let equal = match matched {
                Matched::SettlingTime => "equal settling time",
                Matched::PeakSpeed => "equal peak speed",
            };
            distribution(summary, matched, limits, &format!("{equal}: {what}"), x.clone(), column)
        };
        Matched::ALL.map(panel).to_vec()
    };
    let rows = [
        row("settled to 2 %", Axis::new("settling time [s]", 0.0..10.0), 0),
        row("of those, path", Axis::new("path length / straight line", 1.0..3.0), 1),
        row("of those, overshoot", Axis::new("overshoot [mm]", 0.0..100.0), 2),
        row("of those, speed", Axis::logarithmic("peak joint speed [rad/s]", 0.3..100.0), 4),
    ];
    chart(name, title, &rows)
}

/// Returns a panel with the cumulative distribution of a quantity for each law: the fraction of all tasks whose value is at most
/// x. A curve that ends below 100 % shows that tasks failed.
fn distribution(
    summary: &Summary,
    matched: Matched,
    limits: bool,
    title: &str,
    x: Axis,
    column: usize,
) -> Panel {
    let curve = |law: Law| {
        let rows = summary.rows(&Key::new(matched, law, ALL_ARMS, limits, "ideal"));
        let mut sorted: Vec<_> =
            rows.iter().flatten().map(|row| row[column]).filter(|v| v.is_finite()).collect();
        sorted.sort_by(f64::total_cmp);
        let step = sorted.len().div_ceil(POINTS).max(1);
        let share = |count: usize| 100.0 * count as f64 / rows.len().max(1) as f64;
        let mut points: Vec<_> =
            sorted.iter().enumerate().step_by(step).map(|(i, v)| (*v, share(i + 1))).collect();
        points.extend(points.last().map(|_| (x.range.end, share(sorted.len()))));
        series(law, points)
    };
    let series = Law::all().map(curve).collect();
    Panel {
        title: title.to_owned(),
        x,
        y: Axis::new("share of all tasks [%]", 0.0..100.0),
        series,
        ..Panel::default()
    }
}

fn latency(findings: &Findings) -> Figure {
    let panel = |limits: bool, title: &str| {
        let curve = |law: Law| {
            let ages = findings.ageing(law, limits).map_or(&[][..], |ageing| &ageing.settled_percent);
            series(law, ages.iter().map(|(age, share)| (*age, share.value)).collect())
        };
        Panel {
            title: title.to_owned(),
            x: Axis::logarithmic("age of the joint states [ms]", 4.0..400.0),
            y: Axis::new("of the tasks that settle with fresh ones [%]", 0.0..100.0),
            series: Law::all().map(curve).collect(),
            ..Panel::default()
        }
    };
    let rows = [vec![panel(false, "no limits"), panel(true, "the servo's limits")]];
    chart("compare_latency", "Old joint states, gains for equal settling time", &rows)
}

/// Returns the curve of a law. Laws with the transpose are dashed.
fn series(law: Law, points: Vec<(f64, f64)>) -> Series {
    let line = if law.map() == Map::Transpose { Line::Dashed } else { Line::Solid };
    Series { name: law.name().to_owned(), color: law_color(law), line, points }
}
