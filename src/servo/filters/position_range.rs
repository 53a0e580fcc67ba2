//! The position limits of the joints.

use super::{Filter, Given, between};

/// Cuts what of the velocity goes too fast towards a position limit.
#[derive(Default)]
pub(super) struct PositionRange {
    /// The first joint, counted from 0, that was cut near its limit: it is held back by it.
    pub held_back: Option<usize>,
}

impl Filter for PositionRange {
    fn apply(&mut self, given: &Given, velocity: &mut [f64]) {
        self.held_back = None;
        let limits = &given.settings.limits;
        for (joint, (speed, position)) in velocity.iter_mut().zip(given.positions).enumerate() {
            let (lowest, highest) =
                limits.position.velocities(joint, *position, &limits.brakes(joint, &given.braking));
            let kept = between(*speed, lowest, highest);
            if kept != *speed && limits.position.is_near(joint, *position) {
                self.held_back.get_or_insert(joint);
            }
            *speed = kept;
        }
    }
}
