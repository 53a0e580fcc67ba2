//! Braking of what is too fast all the same: the acceleration limit, which slows all joints as a whole, may come too late for one.

use super::speed::tool_share;
use super::stop::slowed;
use super::{Filter, Given, between};
use crate::servo::jerk::Pace;

/// Brakes each joint that is above its velocity limit, which may have been lowered, or too fast for the position limit ahead, as hard as its
/// own deceleration allows.
pub(super) struct JointBraking;

impl Filter for JointBraking {
    fn apply(&mut self, given: &Given, velocity: &mut [f64]) {
        // The jerk's own filter knows these limits.
        if given.braking.limits_jerk() {
            return;
        }
        let limits = &given.settings.limits;
        for (joint, speed) in velocity.iter_mut().enumerate() {
            let brakes = limits.brakes(joint, &given.braking);
            let (lowest, highest) = limits.position.velocities(joint, given.positions[joint], &brakes);
            let allowed = between(*speed, lowest.max(-brakes.speed), highest.min(brakes.speed));
            if allowed != *speed {
                let most = brakes.deceleration * brakes.period;
                let (down, up) = (given.before[joint] - most, given.before[joint] + most);
                *speed = between(allowed, down.min(*speed), up.max(*speed));
            }
        }
    }
}

/// Slows the joints to the tool's speed limits, each as far as its deceleration allows: what was changed for one joint alone may have made
/// the tool faster.
pub(super) struct ToolBraking {
    /// The speeds at which joints go on whose accelerations may not step [rad/s].
    rest: Vec<f64>,
}

impl ToolBraking {
    /// For so many joints.
    pub fn new(joints: usize) -> Self {
        Self { rest: vec![0.0; joints] }
    }

    /// The same where accelerations may not step: what counts is how fast the tool is when they have come to nothing.
    fn ease(&mut self, given: &Given, velocity: &mut [f64]) {
        for (joint, (rest, speed)) in self.rest.iter_mut().zip(&*velocity).enumerate() {
            let step = speed - given.before[joint];
            *rest = Pace { speed: *speed, step }.rest(given.braking.jerk_step(joint));
        }
        let factor = tool_share(&given.settings.limits, &given.arms.tool_speed(&self.rest));
        if factor < 1.0 {
            for (joint, (speed, rest)) in velocity.iter_mut().zip(&self.rest).enumerate() {
                let (pace, most) = (given.pace(joint), given.braking.decelerations[joint] * given.period);
                *speed = pace.speed + pace.towards(factor * rest, most, given.braking.jerk_step(joint));
            }
        }
    }
}

impl Filter for ToolBraking {
    fn apply(&mut self, given: &Given, velocity: &mut [f64]) {
        if given.braking.limits_jerk() {
            return self.ease(given, velocity);
        }
        let factor = tool_share(&given.settings.limits, &given.arms.tool_speed(velocity));
        let joints = velocity.iter_mut().zip(given.before).zip(given.braking.decelerations);
        for ((speed, before), deceleration) in joints {
            let slowest =
                if *speed * before > 0.0 { slowed(*before, 0.0, deceleration * given.period) } else { 0.0 };
            let wanted = factor * *speed;
            if wanted.abs() < speed.abs() {
                let kept = if slowest.abs() > wanted.abs() { slowest } else { wanted };
                *speed = between(kept, speed.min(0.0), speed.max(0.0));
            }
        }
    }
}
