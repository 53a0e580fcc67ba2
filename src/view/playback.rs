//! Runs as the page plays them: recorded ones out of bags, whole from the start.

use super::robot::units;
use crate::arm::{Chain, bounds};
use crate::dq::UnitDualQuaternion;
use crate::runs::{Change, MotionRow, RecordedRun, Sample, What};
use crate::servo::PositionLimits;
use crate::wire::pose_numbers;
use serde_json::{Value, json};

/// Samples of a run that are shown at most, and what is between two of them at least \[s\]: a screen shows no more.
const MOST: usize = 2500;
const STEP: f64 = 0.02;

/// The frame that gives a browser the run of that number.
pub fn playback(run: &RecordedRun, number: usize) -> String {
    json!({ "run": {
        "number": number,
        "name": run.name,
        "joints": run.joints,
        "units": units(&run.arms),
        "reach": reach(run.arms.iter(), run.limits.first().map(|(_, limits)| &limits.position)),
        "threshold": run.damping_thresholds.first().map(|(_, threshold)| threshold),
        "laws": &*run.laws,
        "states": of_kind(run, What::State).map(|change| json!([change.time, change.to])).collect::<Vec<_>>(),
        "motions": run.motions.iter().map(motion).collect::<Vec<_>>(),
        "samples": thinned(&run.samples).map(|shown| sample(run, shown)).collect::<Vec<_>>(),
    }})
    .to_string()
}

/// How far from the base frame's origin the arms reach \[m\]; sliding joints without limits count for nothing, as nobody knows.
pub(super) fn reach<'a>(arms: impl Iterator<Item = &'a Chain>, limits: Option<&PositionLimits>) -> f64 {
    let known = |limit: f64| if limit.abs() < bounds::JOINT_ANGLE { limit } else { 0.0 };
    let ranges = limits.into_iter().flat_map(PositionLimits::ranges);
    let mut ranges = ranges.map(|(lower, upper)| (known(lower), known(upper)));
    arms.map(|arm| arm.base_point().norm() + arm.reach(ranges.by_ref())).fold(0.0, f64::max)
}

fn of_kind(run: &RecordedRun, what: What) -> impl Iterator<Item = &Change> {
    run.changes.iter().filter(move |change| change.what == what)
}

/// The last of what is in force since some time \[s\] each, at `time`.
fn in_force<T>(all: &[(f64, T)], time: f64) -> Option<&T> {
    let later = all.partition_point(|(since, _)| *since <= time);
    Some(&all[later.checked_sub(1)?].1)
}

/// The samples that are shown: none nearer to the one before than a screen shows, and the last.
fn thinned(samples: &[Sample]) -> impl Iterator<Item = &Sample> {
    let length = samples.last().zip(samples.first()).map_or(0.0, |(last, first)| last.time - first.time);
    let step = STEP.max(length / MOST as f64);
    let mut next = f64::NEG_INFINITY;
    let end = samples.len().saturating_sub(1);
    samples.iter().enumerate().filter_map(move |(i, sample)| {
        let shown = sample.time >= next || i == end;
        if shown {
            next = sample.time + step;
        }
        shown.then_some(sample)
    })
}

/// A sample as the page has it: all lengths in the base frame of the first arm.
fn sample(run: &RecordedRun, sample: &Sample) -> Value {
    let arms = arms(run, &sample.positions);
    let tools: Vec<_> = arms.iter().map(|(_, tool)| tool).collect();
    let goal = in_force(&run.goals, sample.time);
    // Of two arms the goal is that of the right tool in the left tool's frame.
    let goal = goal.map(|goal| if let [left, _] = tools[..] { *left * *goal } else { *goal });
    let limits = in_force(&run.limits, sample.time).map_or(&[][..], |limits| &limits.joint_velocity);
    let share = |(speed, limit): (&f64, &f64)| rounded(100.0 * speed.abs() / limit);
    json!({
        "time": rounded(sample.time),
        "links": arms.iter().map(|(links, _)| links).collect::<Vec<_>>(),
        "tool": tools.last().map(|tool| pose_numbers(tool).map(rounded)),
        "goal": goal.map(|goal| pose_numbers(&goal).map(rounded)),
        "error": in_force(&run.errors, sample.time).map(|error| [error.position, error.rotation].map(rounded)),
        "sigma": rounded(sample.smallest_singular_value),
        "speeds": sample.velocities.iter().zip(limits).map(share).collect::<Vec<_>>(),
    })
}

/// Of each arm the origins of base, links and tool \[m\], and the tool's pose.
fn arms(run: &RecordedRun, positions: &[f64]) -> Vec<(Vec<[f64; 3]>, UnitDualQuaternion)> {
    let mut rest = positions;
    let mut place = |arm: &crate::arm::Chain| {
        let (own, others) = rest.split_at_checked(arm.joint_count())?;
        rest = others;
        let (links, tool) = (arm.link_poses(own).ok()?, arm.forward_kinematics(own).ok()?);
        let origins = links.iter().chain([&tool]).map(|pose| pose.translation());
        let all = [arm.base_point()].into_iter().chain(origins);
        Some((all.map(|point| <[f64; 3]>::from(point).map(rounded)).collect(), tool))
    };
    run.arms.iter().map_while(&mut place).collect()
}

fn motion(row: &MotionRow) -> Value {
    json!({ "law": row.law, "start": row.start_s, "figures": row.figures })
}

/// To a hundredth of a millimetre or the like: more cannot be seen. What is no number is none in JSON.
fn rounded(value: f64) -> f64 {
    (value * 1e5).round() / 1e5
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(time: f64) -> Sample {
        Sample {
            time,
            positions: Vec::new(),
            velocities: Vec::new(),
            pose: UnitDualQuaternion::identity(),
            jumped: false,
            smallest_singular_value: f64::NAN,
        }
    }

    #[test]
    fn a_long_run_is_thinned_to_what_a_screen_shows_and_keeps_both_ends() {
        let samples: Vec<_> = (0..=100_000).map(|i| at(0.002 * f64::from(i))).collect();
        let shown: Vec<_> = thinned(&samples).map(|sample| sample.time).collect();
        assert!((MOST - 100..=MOST + 2).contains(&shown.len()), "{}", shown.len());
        assert_eq!((shown[0], *shown.last().unwrap()), (0.0, 200.0));
        let few = [at(0.0), at(1.0), at(1.001)];
        assert_eq!(thinned(&few).count(), 3, "the last is there though it is near");
        assert_eq!(thinned(&[]).count(), 0);
    }
}
