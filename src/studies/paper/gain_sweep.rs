//! Runs diffc and logc with several gains, to show which metrics change with the gain and which do not.

use super::{Laboratory, PaperError, SimulatedRun};
use dq_algebra::UnitDualQuaternion;
use dq_figures::{Axis, COMPONENTS, Figure, Panel, Series, chart, law_color, over_time};
use dq_kinematics::control::Law;
use serde::Serialize;

/// The gains, as multiples of the law's gain in the comparison.
const PARTS: [f64; 4] = [0.5, 1.0, 2.0, 4.0];

/// The result of one simulation of the gain sweep: one law with one gain.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Swept {
    /// The name of the law.
    pub law: &'static str,
    /// The gain of the law [1/s].
    pub gain: f64,
    /// The gain as a multiple of the law's gain in the comparison.
    pub part: f64,
    /// The largest joint speed [rad/s].
    pub peak_rad_s: f64,
    /// The time until the errors of rotation and position stay below 2 % of their initial values \[s\]; `None` if they do not.
    pub settling_s: Option<f64>,
    /// The path length divided by the distance between the ends of the path; `None` if that distance is below a millimeter.
    pub path_ratio: Option<f64>,
}

/// Runs diffc and logc with each gain. Returns the results and the figure.
///
/// # Errors
/// [`PaperError`] if a simulation fails.
pub fn gain_sweep(lab: &Laboratory) -> Result<(Vec<Swept>, Figure), PaperError> {
    let (mut rows, mut curves) = (Vec::new(), Vec::new());
    for (law, duration) in
        [(Law::Diffc, lab.experiment.diffc.duration), (Law::Logc, lab.experiment.comparison.duration)]
    {
        for part in PARTS {
            let gain = part * lab.gain(law);
            let run = lab.run(lab.controller(law, gain), duration)?;
            let figures = lab.metrics(&run)?.figures;
            curves.push((law, distance(&run, gain)));
            rows.push(Swept {
                law: law.name(),
                gain,
                part,
                peak_rad_s: figures.peak_joint_speed,
                settling_s: figures.settling_time(),
                path_ratio: figures.path_ratio,
            });
        }
    }
    let figure = figure(&rows, curves);
    Ok((rows, figure))
}

/// Returns the curve of the tool's distance from the goal over time.
fn distance(run: &SimulatedRun, gain: f64) -> Series {
    /// Number of samples from one point of the curve to the next.
    const STEP: usize = 25;
    let samples = run.trajectory.times.iter().zip(&run.poses).step_by(STEP);
    let distance = |pose: &UnitDualQuaternion| (pose.translation() - run.goal.translation()).norm();
    let points = samples.map(|(time, pose)| (*time, distance(pose)));
    Series::solid(format!("gain {gain}"), law_color(run.controller.law), points)
}

/// Returns a panel with the curves of a law. Each gain has its own color.
fn of_law(law: Law, curves: &[(Law, Series)]) -> Panel {
    let of = curves.iter().filter(|(of, _)| *of == law).zip(COMPONENTS);
    let series: Vec<_> = of.map(|((_, series), color)| Series { color, ..series.clone() }).collect();
    let end = series.iter().flat_map(|series| series.points.last()).map(|point| point.0).fold(0.0, f64::max);
    over_time(
        &format!("{law}: distance to the goal"),
        Axis::new("time [s]", 0.0..end),
        "distance [m]",
        series,
    )
}

fn figure(rows: &[Swept], curves: Vec<(Law, Series)>) -> Figure {
    let panel = |title: &str, y: Axis, value: fn(&Swept) -> Option<f64>| {
        let curve = |law: Law| {
            let of_law = rows.iter().filter(|row| row.law == law.name());
            let points = of_law.filter_map(|row| Some((row.part, value(row)?)));
            Series::solid(law.name(), law_color(law), points)
        };
        Panel {
            title: title.to_owned(),
            x: Axis::logarithmic("gain / gain of the comparison", PARTS[0]..PARTS[PARTS.len() - 1]),
            y,
            series: [Law::Diffc, Law::Logc].map(curve).into(),
            ..Panel::default()
        }
    };
    let of = |value: fn(&Swept) -> Option<f64>| rows.iter().filter_map(value).fold(0.0, f64::max);
    type Value = fn(&Swept) -> Option<f64>;
    let [peak, time, path]: [Value; 3] =
        [|row| Some(row.peak_rad_s), |row| row.settling_s, |row| row.path_ratio];
    let least = rows.iter().map(|row| row.peak_rad_s).fold(f64::INFINITY, f64::min);
    let panels = [
        vec![
            panel("speed", Axis::logarithmic("peak joint speed [rad/s]", 0.8 * least..1.2 * of(peak)), peak),
            panel("settled to 2 %", Axis::new("settling time [s]", 0.0..1.1 * of(time).max(1.0)), time),
            panel("path", Axis::new("path length / straight line", 1.0..1.02 * of(path)), path),
        ],
        [Law::Diffc, Law::Logc].map(|law| of_law(law, &curves)).into(),
    ];
    chart("gain_sweep", "Both laws as the gain is increased", &panels)
}
