//! A recorded run as figures and metrics need it.

use super::Thinned;
use crate::arm::Chain;
use crate::dq::UnitDualQuaternion;
use crate::servo::{Figures, GoalError, Limits, Violation};
use serde::Serialize;

/// One servo's run.
#[derive(Clone, Debug)]
pub struct RecordedRun {
    /// The namespace, and for two arms their servo's.
    pub name: String,
    /// Joint names, arm after arm; of two arms with the arm's name.
    pub joints: Vec<String>,
    /// The arms, in the base frame of the first.
    pub arms: Vec<Chain>,
    /// At each joint state, of a long run at some of them.
    pub samples: Thinned<Sample>,
    /// Commands, of a long run the largest of some at a time, with their times \[s\] [rad/s].
    pub commands: Thinned<(f64, Vec<f64>)>,
    /// Positions that an arm was sent which takes those, with their times \[s\] \[rad, prismatic: m\]; not numbers between two of which
    /// one is no way on from the other.
    pub sent: Thinned<(f64, Vec<f64>)>,
    /// How far each cycle, of a long run the worst of some, was from its period \[s\] \[ms\].
    pub jitter: Thinned<(f64, f64)>,
    /// When goal, law or state changed.
    pub changes: Thinned<Change>,
    /// Each law with the time \[s\] since which it was in force; empty where the bag does not say.
    pub laws: Thinned<(f64, String)>,
    /// The goals with the times \[s\] at which they came, those of streams among them, each once.
    pub goals: Thinned<(f64, UnitDualQuaternion)>,
    /// The motions to the goals.
    pub motions: Vec<MotionRow>,
    /// How many motions there were after those.
    pub more_motions: usize,
    /// Commands that break a rule, with their times \[s\]; judged only where the commands say what they were made from.
    pub violations: Vec<(f64, Violation)>,
    /// What the commands should keep to, with the times \[s\] since which: the first from the beginning.
    pub limits: Vec<(f64, Limits)>,
    /// The singular values below which the inverse of the Jacobian was damped, with the times \[s\] since which, as the limits.
    pub damping_thresholds: Vec<(f64, f64)>,
    /// Whether the parameters are in the bag; else they are presumed.
    pub parameters_known: bool,
}

impl RecordedRun {
    /// Whether the arm was sent to any goal, as one that is jogged or stands is not.
    pub fn has_goals(&self) -> bool {
        !self.goals.is_empty()
    }

    /// Whether it says how fast the joints were or were to be.
    pub fn has_speeds(&self) -> bool {
        let mut measured = self.samples.iter().map(|sample| &sample.velocities);
        !self.commands.is_empty() || measured.any(|speeds| speeds.iter().all(|speed| speed.is_finite()))
    }
}

/// The run at one time.
#[derive(Clone, Debug)]
pub struct Sample {
    /// Time from the first goal on \[s\], from the run's beginning where it has none.
    pub time: f64,
    /// Joint angles \[rad\].
    pub positions: Vec<f64>,
    /// Joint velocities [rad/s]; not a number where the robot does not report them.
    pub velocities: Vec<f64>,
    /// The controlled pose.
    pub pose: UnitDualQuaternion,
    /// Whether the robot, or its tool, came here from the sample before by a jump, which is no way.
    pub jumped: bool,
    /// How far the pose is from the goal in force.
    pub error: Option<GoalError>,
    /// The smallest singular value of the Jacobian of what is controlled.
    pub smallest_singular_value: f64,
}

/// The kinds of changes that figures mark.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum What {
    /// Another goal came.
    Goal,
    /// Another law came into force.
    Law,
    /// The servo went into another state.
    State,
}

/// A change during the run.
#[derive(Clone, Debug)]
pub struct Change {
    /// Time from the first goal on \[s\], from the run's beginning where it has none.
    pub time: f64,
    /// Which kind of change it is.
    pub what: What,
    /// The law or state that it changed to; for a goal the word itself.
    pub to: String,
}

/// A motion to a goal.
#[derive(Clone, Debug, Default, Serialize)]
pub struct MotionRow {
    /// The bag and the servo.
    pub run: String,
    /// From 1. Another goal begins another motion, if it is not one of a stream, and so does another aim of the law.
    pub motion: usize,
    /// The law when it began, if that is in the bag, and after commas those that came into force before it arrived.
    pub law: Option<String>,
    /// When it began, from the first goal on \[s\].
    pub start_s: f64,
    /// How much of its beginning is not in the bag \[s\], by the servo's status: the figures are of the rest.
    pub missing_s: Option<f64>,
    /// What it was like, by the project's one definition of each figure.
    #[serde(flatten)]
    pub figures: Figures,
    /// How often the servo said `stalled`.
    pub stalls: usize,
    /// Commands that broke a limit, stepped, or moved an arm that was to stand.
    pub violations: usize,
}

impl MotionRow {
    /// The row of a motion that begins at that time \[s\], without its figures.
    pub(super) fn new(run: String, motion: usize, law: Option<String>, start_s: f64) -> Self {
        Self { run, motion, law, start_s, ..Self::default() }
    }
}
