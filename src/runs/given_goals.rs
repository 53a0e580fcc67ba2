//! Measures the motions of an arm whose controller reports no motions. Uses the recorded joint states, and goals that the caller
//! names.

use super::run::MotionRow;
use dq_algebra::UnitDualQuaternion;
use dq_core::servo::STREAM;
use dq_metrics::{GoalError, MotionMeter, Tolerance};
use dq_wire::{Outcome, pose_numbers};
use std::time::Duration;

/// The goals of a controller that does not report its motions.
#[derive(Clone, Debug)]
pub enum GivenGoals {
    /// The goals are the messages on this topic, of `geometry_msgs/msg/PoseStamped`, in the arm's base frame.
    Topic(String),
    /// The only goal is this pose, from the first joint state on.
    Pose(UnitDualQuaternion),
}

impl GivenGoals {
    /// Returns the topic of the goals, if they come from a topic.
    pub(super) fn topic(&self) -> Option<&str> {
        match self {
            Self::Topic(topic) => Some(topic),
            Self::Pose(_) => None,
        }
    }
}

/// Measures the motions of one arm.
pub(super) struct MeasuredMotions {
    run: String,
    tolerance: Tolerance,
    current: Option<MeasuredMotion>,
    ended: Vec<MotionRow>,
    /// The time and the joint positions of the last joint state.
    last: Option<(f64, Vec<f64>)>,
}

/// A motion to one goal, or to the goals of a stream.
struct MeasuredMotion {
    goal: UnitDualQuaternion,
    /// The time of the last goal message of the motion \[s\].
    heard: f64,
    start: f64,
    meter: Option<MotionMeter>,
    is_at_goal: bool,
}

impl MeasuredMotions {
    /// Creates the measurement for the run with this name. A motion counts as arrived if its last pose error is within `tolerance`.
    pub fn new(run: &str, tolerance: Tolerance) -> Self {
        Self { run: run.to_owned(), tolerance, current: None, ended: Vec::new(), last: None }
    }

    /// Processes a goal message that was recorded at `time` \[s\]. Returns true if the goal begins a new motion. Returns false if
    /// the goal equals the current goal within the tolerance, or if it arrived within [`STREAM`] of the last goal message. In these
    /// two cases, `goal` replaces the goal of the current motion.
    pub fn take_goal(&mut self, time: f64, goal: UnitDualQuaternion) -> bool {
        if let Some(current) = &mut self.current {
            let [position, rotation] = current.goal.distances(&goal);
            let is_same = GoalError { position, rotation }.is_within(&self.tolerance);
            let streams = time - current.heard <= STREAM.as_secs_f64();
            current.heard = time;
            if is_same || streams {
                current.goal = goal;
                return false;
            }
        }
        self.end(Outcome::Replaced);
        let meter = None;
        self.current = Some(MeasuredMotion { goal, heard: time, start: time, meter, is_at_goal: false });
        true
    }

    /// Adds a joint state that was measured at `time` \[s\]. If any of the `velocities` is not finite, computes all velocities from
    /// `positions` and the previous positions. Returns the pose error; `None` if there is no goal yet.
    pub fn sample(
        &mut self,
        time: f64,
        pose: &UnitDualQuaternion,
        positions: &[f64],
        velocities: &[f64],
    ) -> Option<GoalError> {
        let before = self.last.replace((time, positions.to_vec()));
        let current = self.current.as_mut()?;
        let [position, rotation] = pose.distances(&current.goal);
        let error = GoalError { position, rotation };
        let speeds = match before {
            _ if velocities.iter().all(|speed| speed.is_finite()) => velocities.to_vec(),
            Some((then, from)) if then < time => {
                positions.iter().zip(&from).map(|(to, from)| (to - from) / (time - then)).collect()
            }
            _ => vec![0.0; positions.len()],
        };
        let now = Duration::try_from_secs_f64(time - current.start).unwrap_or_default();
        let (point, goal) = (pose.translation(), current.goal.translation());
        let begin = || MotionMeter::begin(Duration::ZERO, point, goal, &error, &self.tolerance);
        let meter = current.meter.get_or_insert_with(begin);
        meter.aim_at(goal);
        meter.update(now, point, &error, &speeds);
        current.is_at_goal = error.is_within(&self.tolerance);
        if current.is_at_goal {
            meter.arrived();
        }
        Some(error)
    }

    /// Ends the current motion, if there is one. If the arm is at the goal, the motion counts as arrived. Otherwise the outcome of the
    /// motion is `otherwise`.
    fn end(&mut self, otherwise: Outcome) {
        let Some(MeasuredMotion { goal, start, meter: Some(meter), is_at_goal, .. }) = self.current.take()
        else {
            return;
        };
        let outcome = if is_at_goal { Outcome::Arrived } else { otherwise };
        self.ended.push(MotionRow {
            run: self.run.clone(),
            motion: self.ended.len() + 1,
            law: "-".to_owned(),
            start_s: start,
            outcome: outcome.name().to_owned(),
            goal: Some(pose_numbers(&goal)),
            figures: meter.figures(),
            ..MotionRow::default()
        });
    }

    /// Returns the motions in the order of their starts.
    pub fn finish(mut self) -> Vec<MotionRow> {
        self.end(Outcome::Underway);
        self.ended
    }
}
