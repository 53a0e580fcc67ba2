//! Goals that wait for the transforms of their frames.

use super::{FrameError, FrameTree};
use dq_algebra::UnitDualQuaternion;
use std::collections::VecDeque;
use std::time::Duration;

/// Largest number of goals that wait: 2 s of a stream at 500 Hz.
const MOST: usize = 1000;

/// A goal in a TF frame.
#[derive(Clone, Debug, PartialEq)]
pub struct FramedGoal {
    /// The number of the goal, counted from the first goal.
    pub number: u64,
    /// The name of the TF frame.
    pub frame: String,
    /// The time stamp of the pose \[ns\]; 0 for the newest transform.
    pub stamp: i64,
    /// The number of the goal's publisher.
    pub by: u32,
    /// The time at which the goal was sent. [`WaitingGoals`] does not use this time, so it may be on any clock.
    pub came: Duration,
    /// The pose of the goal in its frame.
    pub frame_from_goal: UnitDualQuaternion,
}

/// The result of the search for a goal's pose.
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    /// The goal.
    pub goal: FramedGoal,
    /// The goal's pose in the base frame, or the reason why it is not known.
    pub base_from_goal: Result<UnitDualQuaternion, FrameError>,
}

/// Goals that wait for transforms that may still arrive, in the order of their arrival. When the pose of a goal is found, the goals
/// that arrived before it are dropped.
#[derive(Clone, Debug, Default)]
pub struct WaitingGoals {
    line: VecDeque<(FramedGoal, Duration)>,
}

impl WaitingGoals {
    /// Adds a goal that arrived at `now`.
    pub fn add(&mut self, goal: FramedGoal, now: Duration) {
        if self.line.len() >= MOST {
            self.line.pop_front();
        }
        self.line.push_back((goal, now));
    }

    /// Removes all goals up to and including the goal `number`.
    pub fn forget(&mut self, number: u64) {
        self.line.retain(|(goal, _)| goal.number > number);
    }

    /// Returns the time at which the oldest goal will have waited for `patience`; `None` if no goal waits.
    pub fn deadline(&self, patience: Duration) -> Option<Duration> {
        self.line.front().map(|(_, came)| came.saturating_add(patience))
    }

    /// Looks up the frame of each goal in `tree` at the time `now`. Returns three kinds of goals: those whose poses in the frame
    /// `base` are found, those whose poses can never be found, and those that have waited for `patience`.
    pub fn look(&mut self, tree: &FrameTree, base: &str, now: Duration, patience: Duration) -> Vec<Answer> {
        let mut answers = Vec::new();
        let found = |goal: &FramedGoal| {
            let base_from_frame = tree.lookup(base, &goal.frame, goal.stamp)?;
            Ok(base_from_frame * goal.frame_from_goal)
        };
        for (goal, came) in std::mem::take(&mut self.line) {
            let base_from_goal = found(&goal);
            let waits = |why: &FrameError| why.may_pass() && now.saturating_sub(came) < patience;
            if base_from_goal.as_ref().is_err_and(waits) {
                self.line.push_back((goal, came));
                continue;
            }
            if base_from_goal.is_ok() {
                self.line.clear();
            }
            answers.push(Answer { goal, base_from_goal });
        }
        answers
    }
}
