//! A goal that moves with its frame.

use super::{FrameTree, FramedGoal};
use dq_algebra::UnitDualQuaternion;
use std::time::Duration;

/// What a frame has done with its goal.
#[derive(Clone, Debug, PartialEq)]
pub enum FrameMotion {
    /// At `stamp` \[ns\], 0 for a frame that never moves, the goal was there.
    To {
        /// The stamp.
        stamp: i64,
        /// The goal.
        base_from_goal: UnitDualQuaternion,
    },
    /// It is not known any more where the frame is.
    Lost,
}

/// Follows the frame of a goal.
#[derive(Clone, Debug)]
pub struct Followed {
    goal: FramedGoal,
    /// The newest stamp, and where the frame was then.
    last: Option<(Option<i64>, UnitDualQuaternion)>,
    heard: Duration,
    lost: bool,
}

impl Followed {
    /// Begins at `now`.
    pub fn new(goal: FramedGoal, now: Duration) -> Self {
        Self { goal, last: None, heard: now, lost: false }
    }

    /// Which goal it is.
    pub fn number(&self) -> u64 {
        self.goal.number
    }

    /// When the frame is lost if nothing is heard of it; none where it is.
    pub fn deadline(&self, patience: Duration) -> Option<Duration> {
        (!self.lost).then_some(self.heard.saturating_add(patience))
    }

    /// What the frame has done since this was asked last. One that moves is lost when there was no newer transform of it for `patience`
    /// by `now`.
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
