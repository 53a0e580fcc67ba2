//! The state of the joints from which the next command is computed.

use crate::{Braking, Limits, Pace, ratio, scale};
use dq_kinematics::arm::Arms;

/// The state of the joints after the last command. The next command is computed from it.
#[derive(Clone, Copy, Debug)]
pub struct Joints<'a> {
    /// The limits that commands never exceed.
    pub limits: &'a Limits,
    /// The joint positions predicted for the time at which the next command takes effect \[rad, prismatic: m\].
    pub positions: &'a [f64],
    /// The commanded motion: the last command less `hold` [rad/s, prismatic: m/s].
    pub before: &'a [f64],
    /// The hold: the part of each command that keeps the joint still against a payload or gravity [rad/s, prismatic: m/s].
    pub hold: &'a [f64],
    /// The braking data of each joint, and the timing of the cycle.
    pub braking: Braking<'a>,
}

impl Joints<'_> {
    /// Returns the commanded speed of joint number `joint`, and the change of this speed by the last command [rad/s, prismatic:
    /// m/s].
    pub(crate) fn pace(&self, joint: usize) -> Pace {
        Pace { speed: self.before[joint], step: self.braking.steps[joint] }
    }

    /// Returns the speed limit that is left for the motion of joint number `joint`: its velocity limit less the size of its
    /// [hold](Self::hold), at least 0 [rad/s, prismatic: m/s].
    pub(crate) fn velocity(&self, joint: usize) -> f64 {
        (self.limits.joint_velocity[joint] - self.hold[joint].abs()).max(0.0)
    }

    /// Scales the joint velocities [rad/s, prismatic: m/s] of `arms` by one factor so that neither joints nor tools exceed their speed
    /// limits. The direction of the motion does not change.
    pub fn keep_speeds(&self, arms: &Arms, velocity: &mut [f64]) {
        let joints = velocity.iter().enumerate();
        let joints = joints.map(|(joint, speed)| ratio(self.velocity(joint), speed.abs()));
        scale(velocity, joints.fold(self.limits.tool_share(&arms.tool_speed(velocity)), f64::min));
    }

    /// Sets `velocity` to the next command of a stop [rad/s, prismatic: m/s]. Each joint slows down from its last command by its
    /// own deceleration, independently of the other joints. The tool therefore leaves its path.
    pub fn stop(&self, velocity: &mut [f64]) {
        for (joint, speed) in velocity.iter_mut().enumerate() {
            let most = self.braking.decelerations[joint] * self.braking.period;
            *speed = self.pace(joint).stopped(most, self.braking.jerk_step(joint));
        }
    }
}
