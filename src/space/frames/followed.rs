//! A goal that moves with its frame.

use super::{FrameTree, FramedGoal};
use dq_algebra::UnitDualQuaternion;
use std::time::Duration;

/// A change of a goal's pose, because the goal's frame has moved or is lost.
#[derive(Clone, Debug, PartialEq)]
pub enum FrameMotion {
    /// The frame has moved the goal.
    To {
        /// The time at which the goal was at this pose \[ns\]; 0 for a frame that never moves.
        stamp: i64,
        /// The pose of the goal in the base frame.
        base_from_goal: UnitDualQuaternion,
    },
    /// TF no longer has the frame, or no longer sends newer transforms of a moving frame.
    Lost,
}

/// A goal whose pose is fixed in a TF frame, so that it moves with this frame.
#[derive(Clone, Debug)]
pub struct Followed {
    goal: FramedGoal,
    /// The newest stamp and the newest pose of the frame; `None` until the frame is first found. The stamp is `None` for a frame
    /// that never moves.
    last: Option<(Option<i64>, UnitDualQuaternion)>,
    heard: Duration,
    lost: bool,
}

impl Followed {
    /// Starts to follow the frame of `goal` at `now`.
    pub fn new(goal: FramedGoal, now: Duration) -> Self {
        Self { goal, last: None, heard: now, lost: false }
    }

    /// Returns the number of the goal.
    pub fn number(&self) -> u64 {
        self.goal.number
    }

    /// Returns when the frame will count as lost if no newer transform arrives: `patience` after its last transform. Returns `None`
    /// if the frame is already lost.
    pub fn deadline(&self, patience: Duration) -> Option<Duration> {
        (!self.lost).then_some(self.heard.saturating_add(patience))
    }

    /// Returns the motion of the goal since the last call; `None` if the goal has not moved. Returns [`FrameMotion::Lost`] once if,
    /// for `patience`, TF has not had the frame, or has sent no newer transform of a moving frame.
    pub fn look(
        &mut self,
        tree: &FrameTree,
        base: &str,
        now: Duration,
        patience: Duration,
    ) -> Option<FrameMotion> {
        let frame = &self.goal.frame;
        let place = tree.newest(base, frame).and_then(|newest| Ok((newest, tree.lookup(base, frame, 0)?)));
        match place {
            Ok(place) if self.last.as_ref() != Some(&place) || (self.lost && place.0.is_none()) => {
                (self.last, self.heard, self.lost) = (Some(place), now, false);
                let base_from_goal = place.1 * self.goal.frame_from_goal;
                Some(FrameMotion::To { stamp: place.0.unwrap_or(0), base_from_goal })
            }
            Ok((None, _)) => {
                self.heard = now;
                None
            }
            _ if !self.lost && now.saturating_sub(self.heard) >= patience => {
                self.lost = true;
                Some(FrameMotion::Lost)
            }
            _ => None,
        }
    }
}
