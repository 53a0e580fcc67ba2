//! The figures of recorded runs, several in one where there are several.

use super::{RecordedRun, Sample, What};
use crate::control::Law;
use crate::dq::UnitDualQuaternion;
use crate::draw::{
    Axis, DrawError, Figure, INK, LIMIT, Line, Mark, Panel, Path, Place, Scene, Series, chart, frameplotter,
    law_color, range_of, scenes,
};
use nalgebra::Isometry3;
use plotters::style::RGBColor;

/// All figures of the runs.
///
/// # Errors
/// [`DrawError::Drawing`].
pub fn plot(runs: &[RecordedRun]) -> Result<Vec<Figure>, DrawError> {
    let runs: Vec<_> = runs.iter().zip(colors(runs)).collect();
    let mut figures = vec![
        over_time(
            "pose_error",
            "Pose error",
            &runs,
            &[
                ("distance from the goal [mm]", |sample| sample.error.map(|error| 1e3 * error.position)),
                ("angle from the goal [°]", |sample| sample.error.map(|error| error.rotation.to_degrees())),
            ],
        )?,
        joint_positions(&runs)?,
        joint_velocities(&runs)?,
        tool_path(&runs)?,
        over_time(
            "singular_value",
            "Smallest singular value of the Jacobian",
            &runs,
            &[("smallest singular value", |sample| Some(sample.smallest_singular_value))],
        )?,
    ];
    if runs.iter().any(|(run, _)| !run.jitter.is_empty()) {
        figures.push(cycle_jitter(&runs)?);
    }
    Ok(figures)
}

/// A run and its colour.
type Colored<'a> = (&'a RecordedRun, RGBColor);

/// Colours of runs, none of them a law's.
const RUNS: [RGBColor; 4] =
    [RGBColor(170, 51, 119), RGBColor(86, 180, 233), RGBColor(230, 159, 0), RGBColor(90, 90, 90)];

/// A law's colour where each run has one law and no other run has it, else one colour each.
fn colors(runs: &[RecordedRun]) -> Vec<RGBColor> {
    let law = |run: &RecordedRun| {
        let law = &run.motions.first()?.law;
        let alone = run.motions.iter().all(|motion| motion.law == *law);
        law.as_ref().filter(|_| alone)?.parse::<Law>().ok()
    };
    let laws: Vec<_> = runs.iter().filter_map(law).collect();
    let distinct = laws.iter().enumerate().all(|(i, law)| !laws[..i].contains(law));
    if laws.len() == runs.len() && distinct {
        return laws.into_iter().map(law_color).collect();
    }
    (0..runs.len()).map(|i| RUNS[i % RUNS.len()]).collect()
}

const TIME: &str = "time from the first goal [s]";

fn time_axis(runs: &[Colored]) -> Axis {
    let times = runs.iter().flat_map(|(run, _)| run.samples.iter().map(|sample| sample.time));
    let (start, end) =
        times.fold((f64::INFINITY, f64::NEG_INFINITY), |(start, end), time| (start.min(time), end.max(time)));
    Axis::new(TIME, if start < end { start..end } else { start..start + 1.0 })
}

/// A panel of `series` with the runs' changes marked.
fn panel(title: &str, label: &str, series: Vec<Series>, runs: &[Colored]) -> Panel {
    let range = range_of(series.iter().flat_map(|series| series.points.iter().map(|point| point.1)));
    let marks = runs.iter().flat_map(|(run, color)| {
        run.changes.iter().map(|change| Mark {
            x: change.time,
            text: change.to.clone(),
            color: if runs.len() > 1 { *color } else { INK },
            line: if change.what == What::State { Line::Dashed } else { Line::Solid },
        })
    });
    let marks = marks.collect();
    Panel { title: title.to_owned(), x: time_axis(runs), y: Axis::new(label, range), series, marks }
}

fn curve(run: &Colored, value: impl Fn(&Sample) -> Option<f64>) -> Series {
    let point = |sample: &Sample| Some((sample.time, value(sample).filter(|value| value.is_finite())?));
    Series {
        name: run.0.name.clone(),
        color: run.1,
        line: Line::Solid,
        points: run.0.samples.iter().filter_map(point).collect(),
    }
}

type Value = fn(&Sample) -> Option<f64>;

fn over_time(
    name: &str,
    title: &str,
    runs: &[Colored],
    values: &[(&str, Value)],
) -> Result<Figure, DrawError> {
    let of = |(label, value): &(&str, Value)| {
        vec![panel("", label, runs.iter().map(|run| curve(run, value)).collect(), runs)]
    };
    chart(name, title, &values.iter().map(of).collect::<Vec<_>>())
}

/// A panel for each joint, three in a row.
fn each_joint(
    name: &str,
    title: &str,
    label: &str,
    runs: &[Colored],
    series: impl Fn(usize) -> Vec<Series>,
) -> Result<Figure, DrawError> {
    let names = runs.iter().map(|(run, _)| &run.joints).max_by_key(|joints| joints.len());
    let panels: Vec<_> = names
        .into_iter()
        .flatten()
        .enumerate()
        .map(|(joint, name)| {
            let mut panel = panel(name, label, series(joint), runs);
            // The same in all of them: the first one tells what they are.
            panel.marks.iter_mut().filter(|_| joint > 0).for_each(|mark| mark.text.clear());
            panel
        })
        .collect();
    chart(name, title, &panels.chunks(3).map(<[Panel]>::to_vec).collect::<Vec<_>>())
}

fn joint_positions(runs: &[Colored]) -> Result<Figure, DrawError> {
    each_joint("joint_positions", "Joint positions", "angle [rad]", runs, |joint| {
        runs.iter().map(|run| curve(run, |sample| sample.positions.get(joint).copied())).collect()
    })
}

/// Measured, commanded, and the limits.
fn joint_velocities(runs: &[Colored]) -> Result<Figure, DrawError> {
    each_joint("joint_velocities", "Joint velocities", "speed [rad/s]", runs, |joint| {
        let mut series = Vec::new();
        for run in runs {
            let measured = curve(run, |sample| sample.velocities.get(joint).copied());
            series.push(Series { name: format!("{}, measured", run.0.name), ..measured });
            let command = |(time, command): &(f64, Vec<f64>)| Some((*time, *command.get(joint)?));
            series.push(Series {
                name: format!("{}, command", run.0.name),
                color: if runs.len() > 1 { run.1 } else { INK },
                line: Line::Dashed,
                points: run.0.commands.iter().filter_map(command).collect(),
            });
        }
        series.extend(limits(runs, joint));
        series
    })
}

fn limits(runs: &[Colored], joint: usize) -> Vec<Series> {
    let known = runs.iter().find(|(run, _)| run.parameters_known);
    let Some(run) = known.or(runs.first()).map(|(run, _)| run) else { return Vec::new() };
    let Some(limit) = run.limits.joint_velocity.get(joint) else { return Vec::new() };
    let name = if run.parameters_known { "limit" } else { "limit (presumed: the bag does not tell)" };
    let time = time_axis(runs).range;
    let line = |limit: f64| Series {
        name: name.to_owned(),
        color: LIMIT,
        line: Line::Solid,
        points: vec![(time.start, limit), (time.end, limit)],
    };
    vec![line(*limit), line(-limit)]
}

/// The frames along the way to its goals: so far apart that they can be told from each other, farther where there are many motions.
fn frames(run: &RecordedRun) -> Vec<Isometry3<f64>> {
    const APART: (f64, f64) = (0.02, 0.2);
    let mut drawn: Option<UnitDualQuaternion> = None;
    let is_apart = |sample: &&Sample| {
        let apart = drawn.is_none_or(|last| {
            let distance = (sample.pose.translation() - last.translation()).norm() / APART.0;
            let angle = sample.pose.rotation().angle_to(&last.rotation()) / APART.1;
            distance + angle > run.motions.len() as f64
        });
        if apart {
            drawn = Some(sample.pose);
        }
        apart
    };
    let on_the_way = run.samples.iter().filter(|sample| sample.error.is_some());
    on_the_way.filter(is_apart).map(|sample| frameplotter(&sample.pose.half_log())).collect()
}

fn tool_path(runs: &[Colored]) -> Result<Figure, DrawError> {
    let path = |(run, color): &Colored| Path {
        name: run.name.clone(),
        color: *color,
        line: Line::Solid,
        points: run.samples.iter().map(|sample| sample.pose.translation()).collect(),
    };
    let frames = if let [(run, _)] = runs { frames(run) } else { Vec::new() };
    let place =
        |name: &str, sample: &Sample| Place { name: name.to_owned(), point: sample.pose.translation() };
    let places: Vec<_> = runs
        .iter()
        .flat_map(|(run, _)| {
            [run.samples.first().map(|s| place("start", s)), run.samples.last().map(|s| place("end", s))]
        })
        .flatten()
        .collect();
    let scene = |view| Scene {
        title: String::new(),
        paths: runs.iter().map(path).collect(),
        frames: frames.clone(),
        axis_length: 0.06,
        places: places.clone(),
        view,
    };
    scenes("path", "Path of the controlled point", &[scene((-60.0, 20.0)), scene((165.0, 15.0))])
}

fn cycle_jitter(runs: &[Colored]) -> Result<Figure, DrawError> {
    let series = |(run, color): &Colored| Series {
        name: run.name.clone(),
        color: *color,
        line: Line::Solid,
        points: run.jitter.clone(),
    };
    let panel = panel("", "cycle minus its period [ms]", runs.iter().map(series).collect(), runs);
    chart("cycle_jitter", "Cycle jitter", &[vec![panel]])
}
