//! What an arm of more joints than its tool needs does with the rest of its motion.

use super::{Filter, Given};
use crate::servo::Posture;

/// Adds the motion towards the posture, in the null space of the law's inverse. It takes no more than the speed that the tool's own motion
/// leaves each joint within its limits, so that the tool is not slowed either. Until a singularity is left it waits.
pub(super) struct NullSpace {
    joint_velocity: Vec<f64>,
}

impl NullSpace {
    /// For so many joints.
    pub fn new(joints: usize) -> Self {
        Self { joint_velocity: vec![0.0; joints] }
    }
}

impl Filter for NullSpace {
    fn apply(&mut self, given: &Given, velocity: &mut [f64]) {
        let Posture { positions, gain } = &given.settings.posture;
        let is_free = given.goal.as_ref().is_some_and(|goal| goal.escape.is_none());
        let is_asked_for = *gain > 0.0 && !positions.is_empty();
        if !(is_free && is_asked_for) {
            return;
        }
        let free = &mut self.joint_velocity;
        for ((free, wanted), position) in free.iter_mut().zip(positions).zip(given.positions) {
            *free = gain * (wanted - position);
        }
        given.settings.controller.leave_tool(given.arms.state(), free);
        let limits = &given.settings.limits.joint_velocity;
        let shares = free.iter().zip(velocity.iter()).zip(limits).map(|((free, speed), limit)| {
            let room = (limit - speed * free.signum()).max(0.0);
            if free.abs() > room { room / free.abs() } else { 1.0 }
        });
        let share = shares.fold(1.0, f64::min);
        velocity.iter_mut().zip(free).for_each(|(speed, free)| *speed += share * *free);
    }
}
