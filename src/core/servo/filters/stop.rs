//! How joints come to rest.

use super::{Filter, Given};

/// Slows each joint down from its last command by its own deceleration, whatever the others do. The tool leaves its path by that.
pub(super) struct Stop;

impl Filter for Stop {
    fn apply(&mut self, given: &Given, velocity: &mut [f64]) {
        for (joint, speed) in velocity.iter_mut().enumerate() {
            let most = given.braking.decelerations[joint] * given.period;
            *speed = given.pace(joint).stopped(most, given.braking.jerk_step(joint));
        }
    }
}
