//! How the command comes to the velocity that is wanted.

use super::stop::slowed;
use super::{Filter, Given, between, ratio};
use crate::servo::jerk::eased;
use crate::servo::limits::STOP_TIME;

/// Scales velocities to a gentle speed where an arm was not seen to follow yet.
pub(super) struct ProbingSpeed;

impl Filter for ProbingSpeed {
    fn apply(&mut self, given: &Given, velocity: &mut [f64]) {
        let factor = given.link.probing_factor(velocity, &given.settings.limits.joint_acceleration);
        velocity.iter_mut().for_each(|speed| *speed *= factor);
    }
}

/// Moves the command of the cycle before towards the velocity by what the acceleration limits allow in a cycle; the change is
/// scaled as a whole, so that a switch neither steps the command nor turns it.
///
/// Where the change as a whole would take longer than a stop, because one joint may hardly accelerate, the joints that are to
/// slow down do so by their own decelerations: a weak joint holds up no other one's braking.
pub(super) struct Acceleration;

impl Filter for Acceleration {
    fn apply(&mut self, given: &Given, velocity: &mut [f64]) {
        let Given { before, period, .. } = *given;
        let eased = |joint: usize, to: f64| eased((to - before[joint]).abs(), given.braking.jerk_step(joint));
        let deltas = before.iter().zip(&*velocity).map(|(from, to)| (to - from).abs());
        let factors = deltas
            .zip(&given.settings.limits.joint_acceleration)
            .enumerate()
            .map(|(joint, (delta, limit))| ratio((limit * period).min(eased(joint, velocity[joint])), delta));
        let factor = factors.fold(1.0, f64::min);
        if factor >= 1.0 {
            return;
        }
        let too_long = factor * STOP_TIME < period;
        let joints = velocity.iter_mut().zip(before).zip(given.braking.decelerations).enumerate();
        for (joint, ((speed, before), deceleration)) in joints {
            let wanted = *speed;
            let slower = between(wanted, before.min(0.0), before.max(0.0));
            let braked = slowed(*before, slower, (deceleration * period).min(eased(joint, slower)));
            let with_the_others = *before + factor * (wanted - *before);
            *speed = if too_long && braked != *before { braked } else { with_the_others };
        }
    }
}
