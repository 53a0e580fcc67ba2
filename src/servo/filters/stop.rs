//! How joints come to rest.

use super::{Filter, Given};

/// Slows each joint down from its last command by its own deceleration, whatever the others do. The tool leaves its path by that.
pub(super) struct Stop;

impl Filter for Stop {
    fn apply(&mut self, given: &Given, velocity: &mut [f64]) {
        velocity.iter_mut().enumerate().for_each(|(joint, speed)| *speed = given.span(joint).stop());
    }
}
