//! What the law asks of the joints where the arm is.

use super::feed_forward::FeedForward;
use super::null_space::NullSpace;
use super::speed::Speed;
use super::{Filter, Given};

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
        let in_order: [&mut dyn Filter; 5] =
            [&mut GainByDelay, &mut EscapeSpeed, &mut self.feed_forward, &mut self.null_space, &mut Speed];
        in_order.into_iter().for_each(|filter| filter.apply(given, velocity));
    }
}

/// Takes the part of the law's gain that the delays allow.
struct GainByDelay;

impl Filter for GainByDelay {
    fn apply(&mut self, given: &Given, velocity: &mut [f64]) {
        let factor = given.goal.as_ref().map_or(1.0, |goal| goal.gain_factor);
        velocity.iter_mut().for_each(|speed| *speed *= factor);
    }
}

/// Raises the speed along the escape from a singularity.
struct EscapeSpeed;

impl Filter for EscapeSpeed {
    fn apply(&mut self, given: &Given, velocity: &mut [f64]) {
        if let Some(escape) = given.goal.as_ref().and_then(|goal| goal.escape) {
            escape.lead(velocity);
        }
    }
}
