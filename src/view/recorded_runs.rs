//! Recorded runs in the page's format.

use super::robot::{link_frames, link_points, reach, units};
use dq_algebra::UnitDualQuaternion;
use dq_kinematics::arm::ArmError;
use dq_metrics::GoalError;
use dq_runs::{ChangeKind, RecordedRun, Sample};
use dq_wire::pose_numbers;
use serde_json::{Value, json};

/// The largest number of samples of each run that a browser gets. A screen has fewer columns of pixels than this.
const MOST_SAMPLES: usize = 4000;

/// Returns the runs as a JSON list, for [`Settings::runs`](super::Settings::runs).
pub fn recorded_runs(runs: &[RecordedRun]) -> String {
    json!(runs.iter().map(run).collect::<Vec<_>>()).to_string()
}

fn run(run: &RecordedRun) -> Value {
    let states = run.changes.iter().filter(|change| change.what == ChangeKind::State);
    let motions = run.motions.iter().map(|motion| json!({ "law": motion.law, "figures": motion.figures }));
    let shown: Vec<_> = run.samples.iter().filter(|sample| run.shown.contains(&sample.time)).collect();
    let step = shown.len().div_ceil(MOST_SAMPLES).max(1);
    let samples = shown.into_iter().step_by(step).filter_map(|state| sample(run, state).ok());
    json!({
        "name": run.name,
        "joints": run.joints,
        "units": units(&run.arms),
        "reach": run.limits.first().map(|(_, limits)| reach(&run.arms, limits)),
        "threshold": run.damping_thresholds.first().map(|(_, threshold)| *threshold),
        "laws": run.laws.to_vec(),
        "states": states.map(|change| json!([change.time, change.to])).collect::<Vec<_>>(),
        "motions": motions.collect::<Vec<_>>(),
        "samples": samples.collect::<Vec<_>>(),
    })
}

fn sample(run: &RecordedRun, state: &Sample) -> Result<Value, ArmError> {
    let Sample { time, positions, velocities, smallest_singular_value, .. } = state;
    let (mut links, mut frames, mut tools, mut first) = (Vec::new(), Vec::new(), Vec::new(), 0);
    for arm in &run.arms {
        let own = &positions[first..first + arm.joint_count()];
        links.push(link_points(arm, own)?);
        frames.extend(link_frames(arm, own)?);
        tools.push(arm.forward_kinematics(own)?);
        first += arm.joint_count();
    }
    // The goal of two arms is the pose of the right tool relative to the left one.
    let frame = if let [left, _] = &tools[..] { *left } else { UnitDualQuaternion::identity() };
    let goal = latest(run.goals.iter().map(|(since, goal)| (*since, goal)), *time);
    let error = latest(run.errors.iter().map(|(since, error)| (*since, error)), *time);
    let error = error.filter(|GoalError { position, rotation }| position.is_finite() && rotation.is_finite());
    let limits = latest(run.limits.iter().map(|(since, limits)| (*since, limits)), *time);
    let limits = limits.map_or(&[][..], |limits| &limits.joint_velocity);
    let speeds = velocities.iter().zip(limits).map(|(speed, limit)| 100.0 * speed.abs() / limit);
    Ok(json!({
        "time": time,
        "links": links,
        "frames": frames,
        "tool": tools.last().map(pose_numbers),
        "goal": goal.map(|goal| pose_numbers(&(frame * *goal))),
        "error": error.map(|GoalError { position, rotation }| [position, rotation]),
        "sigma": smallest_singular_value,
        "speeds": speeds.filter(|speed| speed.is_finite()).collect::<Vec<_>>(),
    }))
}

/// Returns the last of `values` that is in force at `time`. Each value comes with the time from which it is in force.
fn latest<'a, T>(values: impl DoubleEndedIterator<Item = (f64, &'a T)>, time: f64) -> Option<&'a T> {
    values.rev().find(|(since, _)| *since <= time).map(|(_, value)| value)
}
