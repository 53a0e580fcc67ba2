//! A recorded run for figures and tables.

use super::Thinned;
use dq_algebra::UnitDualQuaternion;
use dq_core::servo::{Limits, Violation};
use dq_kinematics::arm::Chain;
use dq_messages::PoseNumbers;
use dq_metrics::{Figures, GoalError, Tolerance};
use dq_space::space::{KeepOut, MOST_KEEP_OUTS, Scene};
use serde::Serialize;
use std::ops::Range;

/// The run of one servo, or of an arm whose servo is unknown. Times \[s\] count from the first motion, or from the beginning of
/// a run without a motion.
#[derive(Clone, Debug)]
pub struct RecordedRun {
    /// The name of the bag, and the namespace of the run.
    pub name: String,
    /// The joint names, arm after arm. With two arms, each name begins with the prefix of its arm.
    pub joints: Vec<String>,
    /// The arms, in the base frame of the first arm.
    pub arms: Vec<Chain>,
    /// A sample for each joint state. In a long run, only some joint states have a sample.
    pub samples: Thinned<Sample>,
    /// The commands of each arm.
    pub commands: Vec<ArmCommands>,
    /// The distances from the goal that the servo reported, with their times. An entry of NaN separates periods in which the servo
    /// had a goal.
    pub errors: Thinned<(f64, GoalError)>,
    /// The clearances that the servo reported \[m\], with their times. A clearance is the smallest distance between two parts of
    /// the scene. NaN means that no two parts were near each other.
    pub clearances: Thinned<(f64, f64)>,
    /// The keep-outs of the run, with the shapes that they had first. Later changes of a shape are not stored.
    pub keep_outs: Vec<KeepOut>,
    /// The keep-ins of the run, with the shapes that they had first. Later changes of a shape are not stored.
    pub keep_ins: Vec<KeepOut>,
    /// The time and the kind of the first overlap of the arm with a keep-out or with itself. Overlaps that exist from the start are
    /// ignored.
    pub inside: Option<(f64, Violation)>,
    /// The deviations of the cycles from their period \[ms\], with their times. In a long run, an entry has the worst of several cycles.
    pub jitter: Thinned<(f64, f64)>,
    /// The times at which the goal, the law or the servo's state changed.
    pub changes: Thinned<Change>,
    /// The laws, with the times from which they were in force; empty if unknown.
    pub laws: Thinned<(f64, String)>,
    /// The goals, including those of streams, each with the time from which it was in force.
    pub goals: Thinned<(f64, UnitDualQuaternion)>,
    /// The motions that the servo reported or, if no servo reports its motions, the motions measured toward goals that the caller
    /// gave.
    pub motions: Vec<MotionRow>,
    /// The limits of the commands, each with the time from which it applies. The first limits apply from the beginning.
    pub limits: Vec<(f64, Limits)>,
    /// The thresholds of damping, each with the time from which it applies. The first one applies from the beginning.
    pub damping_thresholds: Vec<(f64, f64)>,
    /// The goal tolerance when the servo started.
    pub tolerance: Tolerance,
    /// Whether the servo's parameters are in the bag. If not, the parameters that the caller of [`recorded`](crate::recorded) gave are
    /// assumed.
    pub parameters_known: bool,
    /// The time interval that figures show. Parts of the run that are far away from it are left out.
    pub shown: Range<f64>,
    /// Notes about parts that are not shown, one line each.
    pub notes: Vec<String>,
}

/// A gap between two joint states divides a run into two parts only if it is longer than this \[s\].
const APART: f64 = 60.0;

/// A gap between two joint states divides a run into two parts only if it is also longer than this factor times the recorded
/// duration.
const FAR: f64 = 10.0;

/// Splits a run at its long gaps: those longer than [`APART`] and longer than [`FAR`] times the recorded duration. The recorded duration
/// is the time without gaps longer than [`APART`]. Returns the time interval \[s\] and the number of joint states of each part.
fn parts(times: impl Iterator<Item = f64> + Clone) -> Vec<(Range<f64>, usize)> {
    let steps = times.clone().zip(times.clone().skip(1)).map(|(one, next)| next - one);
    let recorded: f64 = steps.filter(|step| *step <= APART).sum();
    let mut parts: Vec<(Range<f64>, usize)> = Vec::new();
    for time in times {
        match parts.last_mut() {
            Some((part, count)) if time - part.end <= APART.max(FAR * recorded) => {
                (part.end, *count) = (time, *count + 1);
            }
            _ => parts.push((time..time, 1)),
        }
    }
    parts
}

/// The commands of one arm, with their times. In a long run, several commands share an entry, with the largest velocity of each
/// joint.
#[derive(Clone, Debug)]
pub struct ArmCommands {
    /// The index of the arm's first joint among all joints.
    pub first_joint: usize,
    /// The velocities [rad/s, prismatic: m/s].
    pub velocities: Thinned<(f64, Vec<f64>)>,
    /// The positions \[rad, prismatic: m\]. An entry of NaN stands for a pause in which the servo sent nothing.
    pub positions: Thinned<(f64, Vec<f64>)>,
}

impl RecordedRun {
    /// Returns whether the run has measured or commanded speeds.
    pub fn has_speeds(&self) -> bool {
        let mut measured = self.samples.iter().map(|sample| &sample.velocities);
        self.commands.iter().any(|arm| !arm.velocities.is_empty())
            || measured.any(|speeds| speeds.iter().all(|speed| speed.is_finite()))
    }

    /// Returns the smallest clearance \[m\]; `None` if the servo reported none.
    pub fn least_clearance(&self) -> Option<f64> {
        self.clearances.iter().map(|(_, clearance)| *clearance).filter(|it| it.is_finite()).reduce(f64::min)
    }

    /// Adds those keep-outs and keep-ins of `scene` whose names are new.
    pub(super) fn add_scene(&mut self, scene: Option<&Scene>) {
        let Some(scene) = scene else { return };
        for (known, next) in
            [(&mut self.keep_outs, scene.keep_outs()), (&mut self.keep_ins, scene.keep_ins())]
        {
            for solid in next {
                if known.len() < MOST_KEEP_OUTS && known.iter().all(|one| one.name != solid.name) {
                    known.push(solid.clone());
                }
            }
        }
    }

    /// Selects the part of the run that figures show: the part with the most joint states. Adds a note about each other part.
    pub(super) fn show_most(&mut self) {
        let parts = parts(self.samples.iter().map(|sample| sample.time));
        let Some((shown, _)) = parts.iter().max_by_key(|(_, count)| *count).cloned() else { return };
        let line = |(part, count): &(Range<f64>, usize)| {
            let (away, side) = match part.start < shown.start {
                true => (shown.start - part.end, "before"),
                false => (part.start - shown.end, "after"),
            };
            let states = if *count == 1 {
                "a joint state".to_owned()
            } else {
                format!("{count} joint states or more")
            };
            format!("{}: {states} {away:.0} s {side} the rest: left out of the figures", self.name)
        };
        let left_out: Vec<_> = parts.iter().filter(|(part, _)| *part != shown).map(line).collect();
        self.notes.extend(left_out);
        self.shown = shown;
    }

    /// Subtracts `zero` from all times \[s\].
    pub(super) fn begin_at(&mut self, zero: f64) {
        self.shown = self.shown.start - zero..self.shown.end - zero;
        self.samples.iter_mut().for_each(|sample| sample.time -= zero);
        for arm in &mut self.commands {
            arm.velocities.iter_mut().chain(arm.positions.iter_mut()).for_each(|(time, _)| *time -= zero);
        }
        self.errors.iter_mut().for_each(|(time, _)| *time -= zero);
        self.clearances.iter_mut().for_each(|(time, _)| *time -= zero);
        self.inside.iter_mut().for_each(|(time, _)| *time -= zero);
        self.jitter.iter_mut().for_each(|(time, _)| *time -= zero);
        self.changes.iter_mut().for_each(|change| change.time -= zero);
        self.laws.iter_mut().for_each(|(time, _)| *time -= zero);
        self.goals.iter_mut().for_each(|(time, _)| *time -= zero);
        self.motions.iter_mut().for_each(|motion| motion.start_s -= zero);
        self.limits.iter_mut().for_each(|(time, _)| *time -= zero);
        self.damping_thresholds.iter_mut().for_each(|(time, _)| *time -= zero);
    }
}

/// The state of a run at one time.
#[derive(Clone, Debug)]
pub struct Sample {
    /// The time \[s\].
    pub time: f64,
    /// The joint positions \[rad, prismatic: m\].
    pub positions: Vec<f64>,
    /// The joint velocities [rad/s, prismatic: m/s]; NaN if the robot does not report them.
    pub velocities: Vec<f64>,
    /// The controlled pose.
    pub pose: UnitDualQuaternion,
    /// Whether the robot or its tool jumped at this time. If so, no path is drawn from the previous sample to this one.
    pub jumped: bool,
    /// The smallest singular value of the controlled Jacobian.
    pub smallest_singular_value: f64,
}

/// A kind of change that figures mark.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChangeKind {
    /// A motion to another goal began.
    Goal,
    /// Another law came into force.
    Law,
    /// The servo entered another state.
    State,
}

/// A change during the run.
#[derive(Clone, Debug)]
pub struct Change {
    /// The time \[s\].
    pub time: f64,
    /// The kind of change.
    pub what: ChangeKind,
    /// The new law or state; the word "goal" for a goal.
    pub to: String,
}

/// A motion to a goal, as the servo reported it or, without such reports, as this program measured it.
#[derive(Clone, Debug, Default, Serialize)]
pub struct MotionRow {
    /// The names of the bag and of the servo.
    pub run: String,
    /// The number of the motion in this bag, counted from 1.
    pub motion: usize,
    /// The names of the laws in force during the motion, separated by commas. The first one is the law at the start of the motion.
    pub law: String,
    /// The gains of the law, as text.
    pub gains: String,
    /// When the motion began \[s\].
    pub start_s: f64,
    /// The name of the outcome.
    pub outcome: String,
    /// The reason for the outcome, if the outcome needs one to be understood.
    pub why: Option<String>,
    /// Whether the arm has started a reconfiguration during the motion.
    pub reconfigured: bool,
    /// The publisher of the goal.
    pub asked_by: Option<String>,
    /// The goal. For a stream, its last goal.
    pub goal: Option<PoseNumbers>,
    /// The metrics of the motion.
    #[serde(flatten)]
    pub figures: Figures,
    /// The largest commanded speed of each joint, as a fraction of its limit.
    pub peak_joint_speeds_of_limits: Vec<f64>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn states_far_from_the_rest_are_another_part() {
        let run = |from: f64| (0..100).map(move |step| from + 0.1 * f64::from(step));
        let ends = |times: Vec<f64>| {
            let parts = parts(times.into_iter());
            parts.iter().map(|(part, count)| (part.start, *count)).collect::<Vec<_>>()
        };
        let year = 3.2e7;
        assert_eq!(ends(run(0.0).chain(run(60.0)).collect()), [(0.0, 200)], "a pause");
        assert_eq!(ends([0.0].into_iter().chain(run(1.8e9)).collect()), [(0.0, 1), (1.8e9, 100)]);
        assert_eq!(ends(run(5.0).chain([year]).collect()), [(5.0, 100), (year, 1)]);
        assert_eq!(ends(run(0.0).chain(run(2.0 * 86_400.0)).collect()), [(0.0, 100), (2.0 * 86_400.0, 100)]);
        assert_eq!(ends(vec![7.0]), [(7.0, 1)]);
        // A recording of an hour that has one state per minute is a single part.
        assert_eq!(ends((0..60).map(|minute| 60.0 * f64::from(minute)).collect()), [(0.0, 60)]);
    }
}
