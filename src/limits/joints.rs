//! The joints between two commands.

use crate::{Braking, Limits, Pace, ratio, scale};
use dq_kinematics::arm::Arms;

/// The joints between two commands: what the next one is made by.
#[derive(Clone, Copy, Debug)]
pub struct Joints<'a> {
    /// What the commands never exceed.
    pub limits: &'a Limits,
    /// Where the joints are when the next command reaches them \[rad, prismatic: m\].
    pub positions: &'a [f64],
    /// The motion commanded before: the last command without `hold` [rad/s, prismatic: m/s].
    pub before: &'a [f64],
    /// The part of each command that balances what pulls at the joint, and moves it nowhere [rad/s, prismatic: m/s].
    pub hold: &'a [f64],
    /// What each joint has for braking, and the cycle.
    pub braking: Braking<'a>,
}

impl Joints<'_> {
    /// The speed of joint number `joint`, and what the last command changed it by.
    pub(crate) fn pace(&self, joint: usize) -> Pace {
        Pace { speed: self.before[joint], step: self.braking.steps[joint] }
    }

    /// The largest speed of joint number `joint` beside its hold [rad/s, prismatic: m/s].
    pub(crate) fn velocity(&self, joint: usize) -> f64 {
        (self.limits.joint_velocity[joint] - self.hold[joint].abs()).max(0.0)
    }

    /// Scales joint velocities [rad/s, prismatic: m/s] of `arms` by one factor so that neither joints nor tools exceed their speed limits.
    /// The direction of the motion stays.
    pub fn keep_speeds(&self, arms: &Arms, velocity: &mut [f64]) {
        let joints = velocity.iter().enumerate();
        let joints = joints.map(|(joint, speed)| ratio(self.velocity(joint), speed.abs()));
        scale(velocity, joints.fold(self.limits.tool_share(&arms.tool_speed(velocity)), f64::min));
    }

    /// Makes of the `velocity`, whatever it is, the next one of a stop [rad/s, prismatic: m/s]: each joint slows down from its last command by its
    /// own deceleration, whatever the others do. The tool leaves its path by that.
    pub fn stop(&self, velocity: &mut [f64]) {
        for (joint, speed) in velocity.iter_mut().enumerate() {
            let most = self.braking.decelerations[joint] * self.braking.period;
            *speed = self.pace(joint).stopped(most, self.braking.jerk_step(joint));
        }
    }
}
