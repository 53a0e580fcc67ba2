//! A goal that moves with its frame.

use super::{FrameTree, FramedGoal};
use dq_algebra::UnitDualQuaternion;
use std::time::Duration;

/// The motion of a goal with its frame.
#[derive(Clone, Debug, PartialEq)]
pub enum FrameMotion {
    /// At `stamp` \[ns\], which is 0 for a frame that never moves, the goal was at this pose.
    To {
        /// The stamp.
        stamp: i64,
        /// The goal.
        base_from_goal: UnitDualQuaternion,
    },
    /// TF no longer has the frame.
    Lost,
}

/// Follows the frame of a goal.
#[derive(Clone, Debug)]
pub struct Followed {
    goal: FramedGoal,
    /// The newest stamp, and the pose of the frame at that time.
    last: Option<(Option<i64>, UnitDualQuaternion)>,
    heard: Duration,
    lost: bool,
}

impl Followed {
    /// Starts at `now`.
    pub fn new(goal: FramedGoal, now: Duration) -> Self {
        Self { goal, last: None, heard: now, lost: false }
    }

    /// Returns the number of the goal.
    pub fn number(&self) -> u64 {
        self.goal.number
    }

    /// Returns when the frame counts as lost if no transform arrives; `None` if it already is.
    pub fn deadline(&self, patience: Duration) -> Option<Duration> {
        (!self.lost).then_some(self.heard.saturating_add(patience))
    }

    /// Returns the motion of the frame since the last call. A moving frame is lost if no newer transform of it arrived for `patience` until
    /// `now`.
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
