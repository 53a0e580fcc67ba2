//! The sweep as a figure.

use super::summary::{Bin, SweepSummary, percent, settled};
use super::{LAWS, Outcome, Pair};
use crate::control::Law;
use crate::draw::{Axis, Figure, Line, Panel, Series, chart, law_color};

/// Distributions above, who wins where below.
pub fn figure(pairs: &[Pair], summary: &SweepSummary) -> Figure {
    let longest = summary.duration_s;
    let distributions = vec![
        distribution(pairs, "settled to 2 %", Axis::new("settling time [s]", 0.0..longest), |o| {
            o.settling_time.unwrap_or_default()
        }),
        distribution(
            pairs,
            "path of those that settled",
            Axis::new("path length / straight line", 1.0..4.0),
            |o| o.path_ratio,
        ),
        distribution(
            pairs,
            "speed of those that settled",
            Axis::logarithmic("peak joint speed [rad/s]", 0.3..300.0),
            |o| o.peak_joint_speed,
        ),
    ];
    let mut failures = over_angle(summary, "did not settle", |bin| bin.failures_percent);
    let most = summary.by_angle.iter().flat_map(|bin| bin.failures_percent).fold(1.0, f64::max);
    failures.y.range = 0.0..1.2 * most;
    let winners = vec![
        failures,
        over_angle(summary, "settled first", |bin| bin.fastest_percent),
        over_angle(summary, "settled on the shortest path", |bin| bin.shortest_percent),
    ];
    let title =
        format!("{} random tasks (seed {}), {} s each", summary.pairs, summary.seed, summary.duration_s);
    chart("sweep", &title, &[distributions, winners])
}

/// The share of all tasks whose value is at most x: where a curve ends below 100 %, tasks failed.
fn distribution(pairs: &[Pair], title: &str, x: Axis, value: fn(&Outcome) -> f64) -> Panel {
    let curve = |(i, law): (usize, &Law)| {
        let values = settled(pairs, i, value);
        let point = |(k, value): (usize, &f64)| (*value, percent(k + 1, pairs.len()));
        let mut points: Vec<_> = values.iter().enumerate().map(point).collect();
        points.extend(points.last().map(|last| (x.range.end, last.1)));
        Series { name: law.name().to_owned(), color: law_color(*law), line: Line::Solid, points }
    };
    let series = LAWS.iter().enumerate().map(curve).collect();
    Panel {
        title: format!("{title}: share of all tasks"),
        x,
        y: Axis::new("tasks [%]", 0.0..100.0),
        series,
        ..Panel::default()
    }
}

fn over_angle(summary: &SweepSummary, title: &str, share: fn(&Bin) -> [f64; 3]) -> Panel {
    let curve = |(i, law): (usize, &Law)| {
        let bins = summary.by_angle.iter().filter(|bin| bin.pairs > 0);
        let points = bins.map(|bin| (0.5 * (bin.angle_deg[0] + bin.angle_deg[1]), share(bin)[i])).collect();
        Series { name: law.name().to_owned(), color: law_color(*law), line: Line::Solid, points }
    };
    Panel {
        title: title.to_owned(),
        x: Axis::new("angle between start and goal [°]", 0.0..180.0),
        y: Axis::new("tasks [%]", 0.0..100.0),
        series: LAWS.iter().enumerate().map(curve).collect(),
        ..Panel::default()
    }
}
