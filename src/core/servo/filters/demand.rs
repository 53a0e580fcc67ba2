//! The velocity demanded by the law at the present joint positions.

use super::{FilterInput, LawGoal};
use dq_algebra::split;
use dq_limits::ratio;

/// Turns the law's velocity into the demanded velocity, in three steps:
///
/// 1. Reduce the velocity to the gain that the delay allows.
/// 2. Add the escape from a singularity, the feed-forward of a moving goal, and the motion to the posture.
/// 3. Scale the sum to the speed limits.
pub(super) struct LawDemand {
    /// The velocity that is added to the law's velocity [rad/s, prismatic: m/s].
    more: Vec<f64>,
}

impl LawDemand {
    /// Allocates for this many joints.
    pub fn new(joints: usize) -> Self {
        Self { more: vec![0.0; joints] }
    }

    /// Adds the joint velocities at which the tool moves with its goal.
    ///
    /// Let `ξ_d` be the goal's body twist, and `e = q_d* q` the error of the tool pose `q` with respect to the goal pose `q_d`. Let
    /// `−K X` be the body twist that the law demands. If the tool's body twist is `ξ = Ad_{e⁻¹} ξ_d − K X`, the twist of the error
    /// is `−K X`. So the error decays as for a fixed goal.
    fn feed_forward(&mut self, input: &FilterInput, goal: &LawGoal, velocity: &mut [f64]) {
        let Some(moving) = &goal.moving else { return };
        let pose = input.arms.pose();
        let twist = (pose.inverse() * moving.pose).adjoint() * moving.twist;
        let rotation = pose.rotation();
        let (angular, linear) = split(&twist);
        let twist = (rotation * angular, rotation * linear);
        input.settings.controller.joint_velocity_of(input.arms.state(), &twist, &mut self.more);
        velocity.iter_mut().zip(&self.more).for_each(|(speed, more)| *speed += more);
    }

    /// Adds the motion to the posture, except while the arm escapes from a singularity.
    ///
    /// This motion does not move the tool in the components that the aim constrains. It is scaled down so that its sum with the law's
    /// velocity keeps each joint's limits on speed and position. So it neither slows the tool nor keeps the tool from its goal.
    fn move_to_posture(&mut self, input: &FilterInput, goal: &LawGoal, velocity: &mut [f64]) {
        let (gain, task) = (input.settings.posture.gain, input.settings.controller.aim.components());
        if goal.escape.is_some() || gain <= 0.0 || input.arms.joint_count() <= task {
            return;
        }
        for ((free, wanted), position) in self.more.iter_mut().zip(goal.posture).zip(input.joints.positions) {
            *free = gain * (wanted - position);
        }
        input.settings.controller.leave_tool(input.arms.state(), &mut self.more);
        let shares = self.more.iter().zip(&*velocity).enumerate().map(|(joint, (free, speed))| {
            let (least, most) = input.joints.span(joint).range;
            let left = if *free < 0.0 { speed - least } else { most - speed };
            ratio(left.max(0.0), free.abs())
        });
        let share = shares.fold(1.0, f64::min);
        velocity.iter_mut().zip(&self.more).for_each(|(speed, free)| *speed += share * free);
    }
}

impl LawDemand {
    /// Turns `velocity`, the law's velocity of each joint [rad/s, prismatic: m/s], into the demanded velocity.
    pub fn apply(&mut self, input: &FilterInput, velocity: &mut [f64]) {
        if let Some(goal) = &input.goal {
            input.settings.controller.soften(input.arms.state(), &goal.pose, goal.allowed, velocity);
            if let Some(escape) = goal.escape {
                escape.lead(velocity);
            }
            self.feed_forward(input, goal, velocity);
            self.move_to_posture(input, goal, velocity);
        }
        input.joints.keep_speeds(input.arms, velocity);
    }
}
