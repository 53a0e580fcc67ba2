//! The motions of a run to its goals, counted as the servo counts them.

use super::run::MotionRow;
use crate::servo::{Goal, GoalError, MotionMeter, STREAM, Tolerance};
use crate::text;
use nalgebra::Vector3;
use std::collections::VecDeque;
use std::time::Duration;

/// Statuses that come late name one of the last so many goals that came as messages.
const LATE_GOALS: usize = 16;

/// So many motions have a row: nobody reads more of them.
const MOST: usize = 10_000;

/// A status comes within so many seconds of what it is about, ten times a second.
const SOON: f64 = 0.25;

/// The goal in force, the motion to it, and those before.
#[derive(Default)]
pub(super) struct Motions {
    rows: Vec<MotionRow>,
    /// Motions that are counted alone.
    more: usize,
    goal: Option<Goal>,
    /// When the servo took the goal, where the bag may have begun later \[s\].
    taken: Option<f64>,
    /// When the goal last was another one \[s\].
    changed: f64,
    /// The last goals that came as messages, the newest last.
    recent: VecDeque<Goal>,
    /// When a message of a goal last came, or the goal was dropped \[s\].
    told: Option<f64>,
    /// The goal with which the motion began, of a stream the last.
    begun: Option<Goal>,
    current: Option<(MotionMeter, MotionRow)>,
    /// What it was before the robot jumped, until the servo says whether it went on.
    before_jump: Option<(MotionMeter, MotionRow)>,
    /// The servo has come to hold although it has a goal: it waits until that is sent again.
    held: bool,
}

/// What a goal that came is.
#[derive(Debug, PartialEq)]
pub(super) enum Came {
    /// The one in force once more.
    Again,
    /// The aim of the motion in progress is moved to it.
    Moved,
    /// It begins a motion.
    Another,
}

/// What there is to measure of a motion at one time.
pub(super) struct Measured<'a> {
    /// Where the controlled point is \[m\].
    pub point: Vector3<f64>,
    /// Where the goal's point is \[m\].
    pub goal_point: Vector3<f64>,
    /// How far the goal is.
    pub error: GoalError,
    /// What the joints were commanded, or did [rad/s].
    pub speeds: &'a [f64],
    /// Whether an arm at that speed stays within the tolerance for a moment.
    pub lingers: bool,
    pub tolerance: &'a Tolerance,
}

impl Motions {
    /// The goal in force.
    pub fn goal(&self) -> Option<&Goal> {
        self.goal.as_ref()
    }

    /// Whether it is the goal in force.
    pub fn is_in_force(&self, goal: &Goal) -> bool {
        self.goal.as_ref().is_some_and(|known| is_same_pose(known, goal))
    }

    /// Whether the servo holds with its goal.
    pub fn is_held(&self) -> bool {
        self.held
    }

    /// Where the goal is at `time` \[s\], which begins nothing: the servo holds, and the goal moves with its frame.
    pub fn move_aim(&mut self, time: f64, goal: Goal) {
        (self.changed, self.goal) = (time, Some(goal));
    }

    /// A message of a goal came at `time` \[s\].
    pub fn hear(&mut self, time: f64, goal: Goal) {
        self.told = Some(time);
        self.recent.push_back(goal);
        if self.recent.len() > LATE_GOALS {
            self.recent.pop_front();
        }
    }

    /// Whether a status at `time` \[s\] that names another goal than that in force says that the servo has taken it, as where no message
    /// of it is in the bag or it is in a frame of TF; else the status is older than what came last.
    pub fn is_news(&self, time: f64, goal: &Goal) -> bool {
        let is_late = self.told.is_some_and(|told| time - told < SOON);
        !is_late && !self.recent.iter().any(|known| is_same_pose(known, goal))
    }

    /// A goal came at `time` \[s\]. One that cannot be distinguished from that with which the motion began only moves the aim, as in the
    /// servo, unless it had to be sent again; and so does one of a stream, of which each is a motion of its own to the servo.
    pub fn pursue(&mut self, time: f64, goal: Goal, tolerance: &Tolerance) -> Came {
        let repeated = self.is_in_force(&goal);
        let streams = self.goal.is_some() && time - self.changed <= STREAM.as_secs_f64();
        let same = self.begun.as_ref().is_some_and(|begun| begun.is_same(&goal, tolerance));
        if !repeated {
            self.changed = time;
        }
        self.goal = Some(goal);
        if !same {
            self.begun = Some(goal);
        }
        match (std::mem::take(&mut self.held), repeated, same || streams) {
            (false, true, _) => Came::Again,
            (false, false, true) => Came::Moved,
            _ => {
                self.end();
                Came::Another
            }
        }
    }

    /// The servo's status says that it took the goal at `time` \[s\], which may be before the bag has anything of it.
    pub fn was_taken(&mut self, time: f64) {
        self.taken = Some(self.taken.map_or(time, |taken| taken.min(time)));
    }

    /// Adds what was measured at `time` \[s\] to the motion in progress, or begins one, whose row `begin` makes of its number. A servo
    /// that holds with its goal moves to none.
    pub fn measure(&mut self, time: f64, measured: &Measured, begin: impl FnOnce(usize) -> MotionRow) {
        if self.held {
            return;
        }
        let Measured { point, goal_point, error, speeds, lingers, tolerance } = measured;
        let now = Duration::from_secs_f64(time.max(0.0));
        let (motion, _) = self.current.get_or_insert_with(|| {
            (MotionMeter::begin(now, *point, *goal_point, error, tolerance), begin(self.rows.len() + 1))
        });
        motion.aim_at(*goal_point);
        motion.update(now, *point, error, speeds);
        if *lingers && error.is_within(tolerance) {
            motion.arrived();
        }
    }

    /// The row of the motion in progress.
    pub fn row(&mut self) -> Option<&mut MotionRow> {
        self.current.as_mut().map(|(_, row)| row)
    }

    /// Another law is in force: a motion that has not arrived is of both.
    pub fn change_law(&mut self, law: &str) {
        if let Some((motion, row)) = &mut self.current
            && motion.figures().arrival_time.is_none()
            && let Some(laws) = row.law.as_mut().filter(|laws| laws.len() < text::LONGEST)
        {
            laws.extend([", ", law]);
        }
    }

    /// The robot is not where it can have moved to.
    pub fn jump(&mut self) {
        if self.before_jump.is_none() {
            self.before_jump = self.current.clone();
        }
    }

    /// The servo is in another state, in which it holds with its goal or not: then the motion ended where the robot still was what it
    /// moved.
    pub fn hold(&mut self, held: bool) {
        let before_jump = self.before_jump.take();
        self.held = held;
        if held {
            self.current = before_jump.or(self.current.take());
            self.end();
        }
    }

    /// The goal is dropped at `time` \[s\].
    pub fn drop_goal(&mut self, time: f64) {
        self.end();
        self.told = Some(time);
        (self.goal, self.begun) = (None, None);
    }

    /// The motion in progress has come to its end.
    pub fn end(&mut self) {
        let taken = self.taken.take();
        self.before_jump = None;
        let Some((motion, mut row)) = self.current.take() else { return };
        row.figures = motion.figures();
        row.missing_s = taken.map(|taken| row.start_s - taken).filter(|missing| *missing > SOON);
        if self.rows.len() < MOST { self.rows.push(row) } else { self.more += 1 }
    }

    /// The motions, and how many more there were.
    pub fn finish(mut self) -> (Vec<MotionRow>, usize) {
        self.end();
        (self.rows, self.more)
    }
}

/// Whether two goals are the same pose: a status has it as the servo has normalised it.
fn is_same_pose(one: &Goal, other: &Goal) -> bool {
    const ROUNDING: f64 = 1e-9;
    (one.base_from_goal().to_vector8() - other.base_from_goal().to_vector8()).norm() < ROUNDING
}

#[cfg(test)]
mod tests {
    use super::*;

    fn goal(x: f64) -> Goal {
        Goal::new([x, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0], "", "base").unwrap()
    }

    #[test]
    fn goals_of_a_stream_are_one_motion_and_waypoints_that_are_repeated_one_each() {
        let tolerance = Tolerance { linear: 1e-3, angular: 1e-2 };
        let mut motions = Motions::default();
        assert_eq!(motions.pursue(0.0, goal(0.0), &tolerance), Came::Another);
        for k in 1..100 {
            let came = motions.pursue(0.5 * f64::from(k), goal(0.1 * f64::from(k)), &tolerance);
            assert_eq!(came, Came::Moved);
        }
        assert_eq!(motions.pursue(52.0, goal(9.9), &tolerance), Came::Again);
        assert_eq!(motions.pursue(53.0, goal(0.0), &tolerance), Came::Another, "after a silence");
        for k in 1..30 {
            assert_eq!(motions.pursue(53.0 + 0.1 * f64::from(k), goal(0.0), &tolerance), Came::Again);
        }
        assert_eq!(motions.pursue(56.0, goal(0.5), &tolerance), Came::Another);
        motions.hold(true);
        assert_eq!(motions.pursue(56.1, goal(0.5), &tolerance), Came::Another, "it had to be sent again");
        motions.drop_goal(56.15);
        assert_eq!(motions.pursue(56.2, goal(0.5), &tolerance), Came::Another);
    }
    #[test]
    fn what_a_motion_was_before_a_jump_is_over_with_it() {
        let tolerance = Tolerance { linear: 1e-3, angular: 1e-2 };
        let measured = Measured {
            point: Vector3::zeros(),
            goal_point: Vector3::zeros(),
            error: GoalError { position: 1.0, rotation: 1.0 },
            speeds: &[],
            lingers: false,
            tolerance: &tolerance,
        };
        let begin = |number| MotionRow { motion: number, ..MotionRow::default() };
        let mut motions = Motions::default();
        motions.pursue(0.0, goal(0.0), &tolerance);
        motions.measure(0.0, &measured, begin);
        motions.jump();
        motions.pursue(5.0, goal(0.5), &tolerance);
        motions.measure(5.0, &measured, begin);
        motions.hold(true);
        let numbers: Vec<_> = motions.finish().0.iter().map(|row| row.motion).collect();
        assert_eq!(numbers, [1, 2]);
    }
}
