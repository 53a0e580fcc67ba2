//! The speed limits of the joints and of the tool.

use super::{Filter, Given, ratio, scale};
use crate::servo::{Limits, ToolSpeed};

/// Scales joint velocities by one factor so that no speed limit is exceeded: the direction stays.
pub(super) struct Speed;

impl Filter for Speed {
    fn apply(&mut self, given: &Given, velocity: &mut [f64]) {
        let limits = &given.settings.limits;
        let joints = velocity.iter().zip(&limits.joint_velocity);
        let joints = joints.map(|(speed, limit)| ratio(*limit, speed.abs()));
        let factor = joints.fold(tool_share(limits, &given.arms.tool_speed(velocity)), f64::min);
        scale(velocity, factor);
    }
}

/// The factor, at most 1, that brings the fastest tool under its speed limits.
pub(super) fn tool_share(limits: &Limits, tool: &ToolSpeed) -> f64 {
    ratio(limits.angular_speed, tool.angular).min(ratio(limits.linear_speed, tool.linear))
}
