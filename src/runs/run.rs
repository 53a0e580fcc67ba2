//! A recorded run as figures and tables need it.

use super::Thinned;
use crate::arm::Chain;
use crate::dq::UnitDualQuaternion;
use crate::servo::{Figures, GoalError, Limits, Tolerance, Violation};
use crate::space::{KeepOut, MOST_KEEP_OUTS, Scene};
use crate::wire::PoseNumbers;
use serde::Serialize;

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

    /// Counts all times from `zero` \[s\].
    pub(super) fn begin_at(&mut self, zero: f64) {
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
