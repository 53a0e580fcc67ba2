//! What the law asks of the joints where the arm is.

use super::feed_forward::FeedForward;
use super::null_space::NullSpace;
use super::{Filter, Given, keep_speed_limits};

/// Makes of the law's velocity what it asks for: the part that delays allow, with what leads out of a singularity, follows a goal that
/// moves and goes to the posture, within the speed limits.
pub(super) struct LawDemand {
    feed_forward: FeedForward,
    null_space: NullSpace,
}

impl LawDemand {
    /// For so many joints.
    pub fn new(joints: usize) -> Self {
        Self { feed_forward: FeedForward::new(joints), null_space: NullSpace::new(joints) }
    }
}

impl Filter for LawDemand {
    fn apply(&mut self, given: &Given, velocity: &mut [f64]) {
        if let Some(goal) = &given.goal {
            velocity.iter_mut().for_each(|speed| *speed *= goal.gain_factor);
            if let Some(escape) = goal.escape {
                escape.lead(velocity);
            }
        }
        self.feed_forward.apply(given, velocity);
        self.null_space.apply(given, velocity);
        keep_speed_limits(given, velocity);
    }
}
