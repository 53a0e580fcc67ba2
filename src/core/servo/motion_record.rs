//! The servo's own record of its motions: what was asked for, what came of it, and what it was like.

use super::{Asker, Figures, Goal, Reconfiguration, Revocation, Stall};
use dq_algebra::UnitDualQuaternion;
use dq_kinematics::control::Controller;
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// What has become of a motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum Outcome {
    /// It goes on.
    #[default]
    Underway,
    /// The arm has settled at the goal, which no stream has moved for [`STREAM`](super::STREAM).
    Arrived,
    /// The arm gets no nearer; the motion goes on where something changes.
    Stalled(Stall),
    /// Another goal was taken before it came to an end.
    Replaced,
    /// The consent was revoked before it came to an end.
    Revoked(Revocation),
}

impl Outcome {
    /// Whether the motion is over.
    pub fn is_end(&self) -> bool {
        !matches!(self, Self::Underway | Self::Stalled(_))
    }
}

/// A motion to a goal, as it was when its outcome became what it is: when it began, when the arm stalled, and at its end. A stream of
/// goals is one motion, and what the arm does after it has arrived belongs to none.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// Which motion it is since the servo's start, from 1.
    pub number: u64,
    /// The goal, of a stream the last one.
    pub goal: Goal,
    /// The stamp of the message that gave it \[ns\].
    pub stamp: i64,
    /// Who asked for it.
    pub asker: Asker,
    /// The law and its gains.
    pub controller: Controller,
    /// The tool, in the tool frame of the arm.
    pub tool: UnitDualQuaternion,
    /// The controlled pose when it began; none before the arm was heard.
    pub start: Option<UnitDualQuaternion>,
    /// When it began, by the cycle's clock.
    pub began: Duration,
    /// What has become of it.
    pub outcome: Outcome,
    /// What is known of another configuration in which the goal can be reached.
    pub reconfiguration: Reconfiguration,
    /// Whether the arm has set out to another configuration on its way.
    pub reconfigured: bool,
    /// What it was like so far.
    pub figures: Figures,
    /// Of each joint, arm after arm, its largest commanded speed as a part of its limit; empty where it has just begun.
    pub peak_speeds: Vec<f64>,
}

impl Motion {
    /// Why it has that outcome, for people, where the outcome alone does not say; `joint` names a joint by its number.
    pub fn why(&self, joint: impl Fn(usize) -> String) -> Option<String> {
        match &self.outcome {
            Outcome::Stalled(stall) => Some(self.reconfiguration.explain(stall, joint)),
            Outcome::Revoked(why) => Some(why.explain(joint)),
            Outcome::Underway | Outcome::Arrived | Outcome::Replaced => None,
        }
    }
}

/// So many motions are kept for whoever asks for them.
pub const MOTIONS: usize = 100;

/// The motions of which there is news.
#[derive(Clone, Debug)]
pub(super) struct MotionLog {
    pub news: Vec<Motion>,
    /// How many motions have begun.
    pub count: u64,
}

impl Default for MotionLog {
    fn default() -> Self {
        Self { news: Vec::with_capacity(MOTIONS), count: 0 }
    }
}

impl MotionLog {
    pub fn push(&mut self, motion: Motion) {
        if self.news.len() >= MOTIONS {
            self.news.remove(0);
        }
        self.news.push(motion);
    }
}
