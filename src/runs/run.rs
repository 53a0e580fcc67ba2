//! A recorded run as figures and tables need it.

use super::Thinned;
use dq_algebra::UnitDualQuaternion;
use dq_core::servo::{Figures, GoalError, Limits, Tolerance, Violation};
use dq_kinematics::arm::Chain;
use dq_messages::PoseNumbers;
use dq_space::space::{KeepOut, MOST_KEEP_OUTS, Scene};
use serde::Serialize;
use std::ops::Range;

/// One servo's run, or that of an arm whose servo is not known. Times are from the first motion on \[s\], from the run's beginning where it
/// has none.
#[derive(Clone, Debug)]
pub struct RecordedRun {
    /// The bag, and the namespace.
    pub name: String,
    /// Joint names, arm after arm; of two arms with the arm's name.
    pub joints: Vec<String>,
    /// The arms, in the base frame of the first.
    pub arms: Vec<Chain>,
    /// At each joint state, of a long run at some of them.
    pub samples: Thinned<Sample>,
    /// What each arm was sent.
    pub commands: Vec<ArmCommands>,
    /// How far the pose was from the goal, as the servo said it, with the times; not numbers between two times with a goal.
    pub errors: Thinned<(f64, GoalError)>,
    /// How far the two parts that are nearest to each other were apart, as the servo said it, with the times \[m\]; no number where none were
    /// near.
    pub clearances: Thinned<(f64, f64)>,
    /// What the arm kept out of, at any time, as it was first.
    pub keep_outs: Vec<KeepOut>,
    /// What the tool stayed in, likewise.
    pub keep_ins: Vec<KeepOut>,
    /// When the arm was first in what it must keep out of, or in itself, other than where it was found.
    pub inside: Option<(f64, Violation)>,
    /// How far each cycle, of a long run the worst of some, was from its period \[ms\].
    pub jitter: Thinned<(f64, f64)>,
    /// When goal, law or state changed.
    pub changes: Thinned<Change>,
    /// Each law with the time since which it was in force; empty where the bag does not say.
    pub laws: Thinned<(f64, String)>,
    /// The goals in force since these times, those of streams among them.
    pub goals: Thinned<(f64, UnitDualQuaternion)>,
    /// The motions to the goals, as the servo said them; none where it did not.
    pub motions: Vec<MotionRow>,
    /// What the commands should keep to, with the times since which: the first from the beginning.
    pub limits: Vec<(f64, Limits)>,
    /// The singular values below which the inverse of the Jacobian was damped, with the times since which, as the limits.
    pub damping_thresholds: Vec<(f64, f64)>,
    /// How near counted as arrived, when the servo started.
    pub tolerance: Tolerance,
    /// Whether the servo's parameters are in the bag; else they are presumed.
    pub parameters_known: bool,
    /// From when to when figures show it: what lies far from most of it is left out.
    pub shown: Range<f64>,
    /// What is not shown of it, a line each.
    pub notes: Vec<String>,
}

/// Joint states with more time between them \[s\] are of two parts of a run.
const APART: f64 = 60.0;

/// Parts with more time between them than so many times as long as all of them are far from each other.
const FAR: f64 = 10.0;

/// The times \[s\] from the first to the last state of each part of a run that is far from the others, and how many states it has.
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

/// What one arm was sent, with the times; of a long run the largest velocities of some at a time.
#[derive(Clone, Debug)]
pub struct ArmCommands {
    /// The number of the arm's first joint among all.
    pub first_joint: usize,
    /// [rad/s, prismatic: m/s].
    pub velocities: Thinned<(f64, Vec<f64>)>,
    /// \[rad, prismatic: m\]; not numbers where positions begin anew.
    pub positions: Thinned<(f64, Vec<f64>)>,
}

impl RecordedRun {
    /// Whether it says how fast the joints were or were to be.
    pub fn has_speeds(&self) -> bool {
        let mut measured = self.samples.iter().map(|sample| &sample.velocities);
        self.commands.iter().any(|arm| !arm.velocities.is_empty())
            || measured.any(|speeds| speeds.iter().all(|speed| speed.is_finite()))
    }

    /// The least of the clearances \[m\], if the servo said any.
    pub fn least_clearance(&self) -> Option<f64> {
        self.clearances.iter().map(|(_, clearance)| *clearance).filter(|it| it.is_finite()).reduce(f64::min)
    }

    /// Adds what of `scene` has a new name.
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

    /// Shows the part of it that has most joint states, and says what is far from that.
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

    /// Counts all times from `zero` \[s\].
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

/// The run at one time.
#[derive(Clone, Debug)]
pub struct Sample {
    /// Time \[s\].
    pub time: f64,
    /// Joint angles \[rad\].
    pub positions: Vec<f64>,
    /// Joint velocities [rad/s]; not a number where the robot does not report them.
    pub velocities: Vec<f64>,
    /// The controlled pose.
    pub pose: UnitDualQuaternion,
    /// Whether the robot, or its tool, came here from the sample before by a jump, which is no way.
    pub jumped: bool,
    /// The smallest singular value of the Jacobian of what is controlled.
    pub smallest_singular_value: f64,
}

/// The kinds of changes that figures mark.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum What {
    /// A motion to another goal began.
    Goal,
    /// Another law came into force.
    Law,
    /// The servo went into another state.
    State,
}

/// A change during the run.
#[derive(Clone, Debug)]
pub struct Change {
    /// Time \[s\].
    pub time: f64,
    /// Which kind of change it is.
    pub what: What,
    /// The law or state that it changed to; for a goal the word itself.
    pub to: String,
}

/// A motion to a goal, as the servo said it.
#[derive(Clone, Debug, Default, Serialize)]
pub struct MotionRow {
    /// The bag and the servo.
    pub run: String,
    /// From 1, in this bag.
    pub motion: usize,
    /// The law when it began, and after commas those in force when something else was said of it.
    pub law: String,
    /// The law's gains.
    pub gains: String,
    /// When it began \[s\].
    pub start_s: f64,
    /// What became of it, in a word.
    pub outcome: String,
    /// Why, where the outcome alone does not say.
    pub why: Option<String>,
    /// Whether the arm has set out to another configuration on its way.
    pub reconfigured: bool,
    /// Who asked for it.
    pub asked_by: Option<String>,
    /// The goal, of a stream the last one.
    pub goal: Option<PoseNumbers>,
    /// What it was like.
    #[serde(flatten)]
    pub figures: Figures,
    /// Of each joint its largest commanded speed as a part of its limit.
    pub peak_joint_speeds_of_limits: Vec<f64>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_far_from_the_rest_is_another_part() {
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
        // A recording of an hour with a state each minute is one.
        assert_eq!(ends((0..60).map(|minute| 60.0 * f64::from(minute)).collect()), [(0.0, 60)]);
    }
}
