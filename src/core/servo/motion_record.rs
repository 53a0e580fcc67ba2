//! The servo's record of its motions: the request, the outcome and the figures.

use super::{Goal, Reconfiguration, Requester, Revocation, Stall};
use dq_algebra::UnitDualQuaternion;
use dq_kinematics::control::Controller;
use dq_metrics::Figures;
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// The outcome of a motion so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum Outcome {
    /// The motion is under way.
    #[default]
    Underway,
    /// The arm has settled at the goal, and no stream has moved the goal for [`STREAM`](super::STREAM).
    Arrived,
    /// The motion has stalled. It continues when the stall ends, for example after a change of the settings.
    Stalled(Stall),
    /// Another goal was taken before the motion ended.
    Replaced,
    /// Consent was revoked before the motion ended.
    Revoked(Revocation),
}

impl Outcome {
    /// Returns whether the motion is over.
    pub fn is_end(&self) -> bool {
        !matches!(self, Self::Underway | Self::Stalled(_))
    }
}

/// A motion to a goal. The servo records a motion when it begins, when it stalls, and when it ends. A stream of goals is one
/// motion. The arm's behavior after its arrival belongs to no motion.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// The number of the motion since the servo's start, from 1.
    pub number: u64,
    /// The goal; for a stream, the last goal.
    pub goal: Goal,
    /// Whether the goal was joint positions. `goal` is then the pose at these positions.
    pub by_joints: bool,
    /// The stamp of the goal's message \[ns\].
    pub stamp: i64,
    /// The sender of the request.
    pub asker: Requester,
    /// The law and the gains.
    pub controller: Controller,
    /// The pose of the controlled tool in the tool frame of the arm.
    pub tool: UnitDualQuaternion,
    /// The controlled pose at the beginning; `None` before the first joint state.
    pub start: Option<UnitDualQuaternion>,
    /// When the motion began, by the cycle's clock.
    pub began: Duration,
    /// The outcome.
    pub outcome: Outcome,
    /// Information about another configuration in which the goal can be reached.
    pub reconfiguration: Reconfiguration,
    /// Whether the arm has started a reconfiguration during the motion.
    pub reconfigured: bool,
    /// The figures so far.
    pub figures: Figures,
    /// The largest commanded speed of each joint, arm after arm, as a fraction of its limit; empty at the beginning.
    pub peak_speeds: Vec<f64>,
}

impl Motion {
    /// Explains the outcome in words, or returns `None` if the name of the outcome is enough. `joint` names a joint by its number.
    pub fn why(&self, joint: impl Fn(usize) -> String) -> Option<String> {
        match &self.outcome {
            Outcome::Stalled(stall) => Some(self.reconfiguration.explain(stall, joint)),
            Outcome::Revoked(why) => Some(why.explain(joint)),
            Outcome::Underway | Outcome::Arrived | Outcome::Replaced => None,
        }
    }
}

/// Largest number of motion updates that the servo keeps until they are collected.
pub const MOTIONS: usize = 100;

/// The motion updates that the caller has not collected yet.
#[derive(Clone, Debug)]
pub(super) struct MotionLog {
    pub updates: Vec<Motion>,
    /// Number of motions that have begun.
    pub count: u64,
}

impl Default for MotionLog {
    fn default() -> Self {
        Self { updates: Vec::with_capacity(MOTIONS), count: 0 }
    }
}

impl MotionLog {
    pub fn push(&mut self, motion: Motion) {
        if self.updates.len() >= MOTIONS {
            self.updates.remove(0);
        }
        self.updates.push(motion);
    }
}
