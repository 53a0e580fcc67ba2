//! Charts of a run over time.

use super::curve_styles::{StyledRun, each_once};
use crate::{ArmCommands, Change, ChangeKind, RecordedRun, Sample, Thinned};
use dq_core::servo::{CLEARANCE, Limits, PositionLimits};
use dq_figures::{Axis, Color, Figure, INK, LIMIT, Line, Mark, Panel, Series, chart, over_time};
use dq_kinematics::arm::{Chain, JointKind};
use dq_metrics::{GoalError, Tolerance};
use std::f64::consts::PI;

fn time_axis(runs: &[StyledRun]) -> Axis {
    let times = runs.iter().flat_map(|drawn| [drawn.run.shown.start, drawn.run.shown.end]);
    let (start, end) =
        times.fold((f64::INFINITY, f64::NEG_INFINITY), |(start, end), time| (start.min(time), end.max(time)));
    let zero = match runs.iter().filter(|drawn| !drawn.run.motions.is_empty()).count() {
        0 => "the beginning",
        count if count == runs.len() => "the first motion",
        _ => "the first motion, else from the beginning",
    };
    Axis::new(&format!("time from {zero} [s]"), if start < end { start..end } else { start..start + 1.0 })
}

/// The style of the marks for changes of the goal or the law.
const GOAL_OR_LAW: (Line, Color) = (Line::Solid, INK);
/// The style of the marks for changes of the servo's state.
const STATE: (Line, Color) = (Line::Dashed, LIMIT);

/// Returns a panel of `series`, with marks for the changes in the runs. The legend explains the marks.
fn panel(title: &str, label: &str, series: Vec<Series>, runs: &[StyledRun]) -> Panel {
    let mut panel = over_time(title, time_axis(runs), label, series);
    for drawn in runs {
        let mark = |change: &Change| {
            let (line, color) = if change.what == ChangeKind::State { STATE } else { GOAL_OR_LAW };
            let color = if runs.len() > 1 { drawn.color() } else { color };
            Mark { x: change.time, text: change.to.clone(), color, line }
        };
        panel.marks.extend(shown(&drawn.run.changes, &panel.x).map(mark));
    }
    for (name, (line, color)) in [("goal or law changes", GOAL_OR_LAW), ("state changes", STATE)] {
        if panel.marks.iter().any(|mark| mark.line == line) {
            panel.series.push(Series { name: name.to_owned(), color, line, points: Vec::new() });
        }
    }
    panel
}

/// Yields the changes to mark. If there are too many changes to distinguish, leaves out those that are too close to the previous one.
fn shown<'a>(changes: &'a [Change], time: &Axis) -> impl Iterator<Item = &'a Change> {
    /// The largest number of marks of one kind.
    const MOST: usize = 100;
    let length = time.range.end - time.range.start;
    let apart = if changes.len() > MOST { length / MOST as f64 } else { 0.0 };
    let mut last = [f64::NEG_INFINITY; 2];
    changes.iter().filter(move |change| {
        let last = &mut last[usize::from(change.what == ChangeKind::State)];
        let is_shown = change.time - *last >= apart;
        if is_shown {
            *last = change.time;
        }
        is_shown
    })
}

/// Returns the curves of a run, one for each law. A curve breaks at missing values and at jumps.
fn curves(drawn: &StyledRun, value: impl Fn(&Sample) -> Option<f64>) -> Vec<Series> {
    let curve = |(style, samples): (&super::curve_styles::CurveStyle, &[Sample])| {
        let points = samples.iter().flat_map(|sample| points(sample, value(sample)));
        Series::solid(&style.name, style.color, points)
    };
    drawn.samples().map(curve).collect()
}

/// Returns the point of a sample in a curve of `value`, or a gap if there is no value. If the robot jumped to this sample, a gap
/// precedes the point.
fn points(sample: &Sample, value: Option<f64>) -> impl Iterator<Item = (f64, f64)> {
    let gap = (sample.time, f64::NAN);
    let point = value.filter(|value| value.is_finite()).map_or(gap, |value| (sample.time, value));
    sample.jumped.then_some(gap).into_iter().chain([point])
}

/// Returns the figure of the pose error on logarithmic axes, with lines at the goal's tolerances.
pub(super) fn pose_error(runs: &[StyledRun]) -> Figure {
    let millimetres = |error: &GoalError| 1e3 * error.position;
    let degrees = |error: &GoalError| error.rotation.to_degrees();
    let row = |label: &str, part: &dyn Fn(&GoalError) -> f64| {
        let mut series: Vec<_> = runs.iter().flat_map(|drawn| errors(drawn, part)).collect();
        let sizes =
            series.iter().flat_map(|series| &series.points).map(|point| point.1).filter(|size| *size > 0.0);
        let (low, high) =
            sizes.fold((f64::INFINITY, 0.0_f64), |(low, high), size| (low.min(size), high.max(size)));
        series.extend(tolerances(runs, part));
        let mut panel = panel("", label, series, runs);
        if low < high {
            panel.y = Axis::logarithmic(label, low.max(1e-6 * high)..1.2 * high);
        }
        vec![panel]
    };
    let rows = [row("distance from the goal [mm]", &millimetres), row("angle from the goal [°]", &degrees)];
    chart("pose_error", "Pose error", &rows)
}

/// Returns the curves of one component of the error, in the run's styles.
fn errors(drawn: &StyledRun, part: impl Fn(&GoalError) -> f64) -> Vec<Series> {
    let of = |style: &super::curve_styles::CurveStyle| {
        let points = style.part_of(&drawn.run.errors).iter().map(|(time, error)| (*time, part(error)));
        Series::solid(&style.name, style.color, points)
    };
    drawn.styles.iter().map(of).collect()
}

/// Returns a horizontal line for each distinct goal tolerance in the runs.
fn tolerances(runs: &[StyledRun], part: impl Fn(&GoalError) -> f64) -> Vec<Series> {
    let range = time_axis(runs).range;
    let known = runs.iter().filter(|drawn| drawn.run.parameters_known);
    let values = each_once(known.map(|drawn| {
        let Tolerance { linear, angular } = drawn.run.tolerance;
        part(&GoalError { position: linear, rotation: angular })
    }));
    let line = |value| Series::solid("goal tolerance", LIMIT, [range.start, range.end].map(|at| (at, value)));
    values.into_iter().map(|value| line(value).dashed()).collect()
}

/// Returns the lines of a bound, such as a limit, which may change during a run. `holds` returns the bounds of a run, each with the
/// time \[s\] from which it applies. `value` returns the number to draw for a bound; `None` if the bound has no line. If all runs
/// have the same bounds, there is one line. Otherwise there is a line for each run, in the run's color.
fn bounds<V: PartialEq>(
    name: &str,
    runs: &[StyledRun],
    holds: impl Fn(&RecordedRun) -> Vec<(f64, V)>,
    value: impl Fn(&V) -> Option<f64>,
) -> Vec<Series> {
    let (known, presumed) = with_parameters(runs);
    let each: Vec<_> = known.iter().map(|drawn| of_other_values(holds(drawn.run))).collect();
    let (time, same) = (time_axis(runs).range, each.iter().all(|other| *other == each[0]));
    let line = |(drawn, holds): (&&StyledRun, &Vec<(f64, V)>)| {
        let (name, color) = match same {
            true => (format!("{name}{presumed}"), LIMIT),
            false => (format!("{}, {name}{presumed}", drawn.run.name), drawn.color()),
        };
        let steps = holds.iter().enumerate().filter_map(|(i, (since, bound))| {
            let (value, until) = (value(bound)?, holds.get(i + 1).map_or(time.end, |(since, _)| *since));
            Some([(since.max(time.start), value), (until, value)])
        });
        Series::solid(name, color, steps.flatten())
    };
    let lines = known.iter().zip(&each).take(if same { 1 } else { runs.len() }).map(line);
    lines.filter(|line| !line.points.is_empty()).collect()
}

/// Removes each value that is equal to the value before it.
fn of_other_values<V: PartialEq>(mut values: Vec<(f64, V)>) -> Vec<(f64, V)> {
    values.dedup_by(|next, before| next.1 == before.1);
    values
}

/// Returns the runs whose limits are drawn, and a suffix for the names of the limits.
///
/// If some bags have the servo's parameters, returns the runs of these bags, and an empty suffix. Otherwise returns all runs, and a
/// suffix which says that the limits are assumed.
fn with_parameters<'a, 'b>(runs: &'b [StyledRun<'a>]) -> (Vec<&'b StyledRun<'a>>, &'static str) {
    let known: Vec<_> = runs.iter().filter(|drawn| drawn.run.parameters_known).collect();
    match known.is_empty() {
        true => (runs.iter().collect(), " (presumed: the bag does not say)"),
        false => (known, ""),
    }
}

/// Returns the figure of the smallest singular value, with a line at the value below which the inverse of the Jacobian is damped.
pub(super) fn singular_value(runs: &[StyledRun]) -> Figure {
    let value = |sample: &Sample| Some(sample.smallest_singular_value);
    let mut series: Vec<_> = runs.iter().flat_map(|drawn| curves(drawn, value)).collect();
    let threshold = |value: &f64| Some(*value);
    series.extend(bounds("damped below", runs, |run| run.damping_thresholds.clone(), threshold));
    let panel = panel("", "smallest singular value", series, runs);
    chart("singular_value", "Smallest singular value of the Jacobian", &[vec![panel]])
}

/// Returns a figure with a panel for each joint, three in a row.
fn each_joint(
    name: &str,
    title: &str,
    label: impl Fn(JointKind) -> &'static str,
    runs: &[StyledRun],
    series: impl Fn(usize) -> Vec<Series>,
) -> Figure {
    let count = runs.iter().map(|drawn| drawn.run.joints.len()).max().unwrap_or_default();
    let panels: Vec<_> = (0..count)
        .map(|joint| {
            let names = runs.iter().filter_map(|drawn| drawn.run.joints.get(joint));
            let kinds =
                runs.iter().filter_map(|drawn| drawn.run.arms.iter().flat_map(Chain::kinds).nth(joint));
            // If there are several arms, their joints share a panel.
            let title = each_once(names.map(String::as_str)).join(", ");
            let label = each_once(kinds.map(|kind| label(*kind))).join(", ");
            let mut panel = panel(&title, &label, series(joint), runs);
            // All panels have the same marks. Only those of the first panel have names.
            panel.marks.iter_mut().filter(|_| joint > 0).for_each(|mark| mark.text.clear());
            panel
        })
        .collect();
    chart(name, title, &panels.chunks(3).map(<[Panel]>::to_vec).collect::<Vec<_>>())
}

pub(super) fn joint_positions(runs: &[StyledRun]) -> Figure {
    let label = |kind| match kind {
        JointKind::Revolute => "angle [rad]",
        JointKind::Prismatic => "position [m]",
    };
    each_joint("joint_positions", "Joint positions", label, runs, |joint| {
        let mut all = Vec::new();
        for drawn in runs {
            let kind = drawn.run.arms.iter().flat_map(Chain::kinds).nth(joint);
            let curves = curves(drawn, |sample| sample.positions.get(joint).copied());
            let mut of_run =
                [curves, commanded(drawn, |arm| &arm.positions, joint, runs).into_iter().collect()].concat();
            if kind == Some(&JointKind::Revolute) {
                of_run.iter_mut().for_each(|curve| curve.points = unwound(&curve.points));
            }
            all.extend(of_run);
        }
        all.extend(position_limits(runs, joint));
        all
    })
}

/// Breaks the curve of an angle \[rad\] at the points at which the angle wraps.
fn unwound(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut before = f64::NAN;
    let broken = points.iter().flat_map(|&(time, angle)| {
        let begins_anew = (angle - before).abs() > PI;
        before = angle;
        begins_anew.then_some((time, f64::NAN)).into_iter().chain([(time, angle)])
    });
    broken.collect()
}

/// Returns the curve of the commands of this kind to a joint; `None` if the run has no such commands.
fn commanded(
    drawn: &StyledRun,
    kind: impl Fn(&ArmCommands) -> &Thinned<(f64, Vec<f64>)>,
    joint: usize,
    runs: &[StyledRun],
) -> Option<Series> {
    let arm = drawn.run.commands.iter().rev().find(|arm| arm.first_joint <= joint)?;
    let sent = kind(arm);
    let point = |(time, command): &(f64, Vec<f64>)| Some((*time, *command.get(joint - arm.first_joint)?));
    let color = if runs.len() > 1 { drawn.color() } else { INK };
    let curve =
        || Series::solid(format!("{}, command", drawn.run.name), color, sent.iter().filter_map(point));
    (!sent.is_empty()).then(|| curve().dashed())
}

/// Returns the figure of the measured and commanded velocities, with their limits.
pub(super) fn joint_velocities(runs: &[StyledRun]) -> Figure {
    let label = |kind| match kind {
        JointKind::Revolute => "speed [rad/s]",
        JointKind::Prismatic => "speed [m/s]",
    };
    each_joint("joint_velocities", "Joint velocities", label, runs, |joint| {
        let mut series = Vec::new();
        for drawn in runs {
            let measured = curves(drawn, |sample| sample.velocities.get(joint).copied());
            series.extend(
                measured
                    .into_iter()
                    .filter(|curve| curve.points.iter().any(|(_, speed)| speed.is_finite()))
                    .map(|curve| Series { name: format!("{}, measured", curve.name), ..curve }),
            );
            series.extend(commanded(drawn, |arm| &arm.velocities, joint, runs));
        }
        series.extend(limits(runs, joint));
        series
    })
}

fn limits(runs: &[StyledRun], joint: usize) -> Vec<Series> {
    let speeds = |(since, limits): &(f64, Limits)| (*since, limits.joint_velocity.clone());
    let of = |run: &RecordedRun| run.limits.iter().map(speeds).collect();
    let limit = |sign: f64| {
        bounds("limit", runs, of, move |speeds: &Vec<f64>| speeds.get(joint).map(|speed| sign * speed))
    };
    [limit(1.0), limit(-1.0)].concat()
}

/// Returns lines at the position limits that the joint came near in any of the runs. Lines at other limits would only compress the
/// scale.
fn position_limits(runs: &[StyledRun], joint: usize) -> Vec<Series> {
    /// The largest distance that counts as near \[rad, prismatic: m\].
    const NEAR: f64 = 0.2;
    let samples = || runs.iter().flat_map(|drawn| drawn.run.samples.iter());
    let is_near = |limit: &f64| {
        samples().filter_map(|sample| sample.positions.get(joint)).any(|at| (at - limit).abs() < NEAR)
    };
    let positions = |(since, limits): &(f64, Limits)| (*since, limits.position.clone());
    let of = |run: &RecordedRun| run.limits.iter().map(positions).collect();
    let limit = |side: fn(&PositionLimits) -> &Vec<f64>| {
        bounds("limit", runs, of, move |limits| side(limits).get(joint).copied().filter(is_near))
    };
    [limit(|limits| &limits.lower), limit(|limits| &limits.upper)].concat()
}

/// Returns the figure of the smallest distance between two parts of the scene. A dashed line shows [`CLEARANCE`], the distance that
/// the servo's constraints keep.
pub(super) fn clearance(runs: &[StyledRun]) -> Figure {
    let curve = |drawn: &StyledRun| {
        let points = drawn.run.clearances.iter().map(|(time, clearance)| (*time, 1e3 * clearance));
        Series::solid(&drawn.run.name, drawn.color(), points)
    };
    let time = time_axis(runs).range;
    let kept = [time.start, time.end].map(|time| (time, 1e3 * CLEARANCE));
    let kept = Series::solid("clearance that is kept", LIMIT, kept).dashed();
    let series = runs.iter().map(curve).chain([kept]).collect();
    chart("clearance", "Distance of the closest pair", &[vec![panel("", "distance [mm]", series, runs)]])
}

pub(super) fn cycle_jitter(runs: &[StyledRun]) -> Figure {
    let series = |drawn: &StyledRun| {
        let color = if runs.len() > 1 { drawn.color() } else { LIMIT };
        Series::solid(&drawn.run.name, color, drawn.run.jitter.to_vec())
    };
    let panel = panel("", "cycle minus its period [ms]", runs.iter().map(series).collect(), runs);
    chart("cycle_jitter", "Cycle jitter", &[vec![panel]])
}

#[cfg(test)]
mod tests {
    use super::*;
    use dq_algebra::UnitDualQuaternion;

    #[test]
    fn an_angle_that_wraps_breaks_its_curve() {
        let drawn = unwound(&[(0.0, 3.0), (1.0, 3.1), (2.0, -3.1), (3.0, -3.0), (4.0, 0.0), (5.0, 3.0)]);
        let shown: Vec<_> = drawn.iter().map(|(time, angle)| (*time, angle.is_finite())).collect();
        assert_eq!(
            shown,
            [(0.0, true), (1.0, true), (2.0, false), (2.0, true), (3.0, true), (4.0, true), (5.0, true)]
        );
    }

    #[test]
    fn a_curve_breaks_where_there_is_no_number_and_at_jumps() {
        let sample = |(time, speed, jumped)| Sample {
            time,
            positions: Vec::new(),
            velocities: vec![speed],
            pose: UnitDualQuaternion::identity(),
            jumped,
            smallest_singular_value: 1.0,
        };
        let samples =
            [(0.0, 0.1, false), (1.0, f64::NAN, false), (2.0, 0.2, false), (3.0, 0.3, true)].map(sample);
        let all = samples.iter().flat_map(|sample| points(sample, sample.velocities.first().copied()));
        let drawn: Vec<_> = all.map(|(time, speed)| (time, speed.is_finite())).collect();
        assert_eq!(drawn, [(0.0, true), (1.0, false), (2.0, true), (3.0, false), (3.0, true)]);
    }
}
