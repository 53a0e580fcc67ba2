//! The velocity that the law asks for at the present joint positions.

use super::{FilterInput, LawGoal};
use dq_limits::ratio;

/// Turns the law's velocity into its demand: reduces it to the gain that the delay allows, adds the escape from a singularity, the
/// feed-forward of a moving goal and the motion to the posture, and scales the sum to the speed limits.
pub(super) struct LawDemand {
    /// The velocity to add [rad/s, prismatic: m/s].
    more: Vec<f64>,
}

impl LawDemand {
    /// Allocates for this many joints.
    pub fn new(joints: usize) -> Self {
        Self { more: vec![0.0; joints] }
    }

    /// Adds the joint velocities at which the tool moves with its goal.
    ///
    /// With the goal's body twist `ξ_d` and the error `e = q_d* q` (eq. 28), the tool's body twist `ξ = Ad_{e⁻¹} ξ_d − K X` leaves `−K X`
    /// as the twist of the error, which decays as for a fixed goal.
    fn feed_forward(&mut self, input: &FilterInput, goal: &LawGoal, velocity: &mut [f64]) {
        let Some(moving) = &goal.moving else { return };
        let pose = input.arms.pose();
        let twist = (pose.inverse() * moving.pose).adjoint() * moving.twist;
        let rotation = pose.rotation();
        let [angular, linear] = [0, 3].map(|first| rotation * twist.fixed_rows::<3>(first).into_owned());
        input.settings.controller.joint_velocity_of(input.arms.state(), &(angular, linear), &mut self.more);
        velocity.iter_mut().zip(&self.more).for_each(|(speed, more)| *speed += more);
    }

    /// Adds the motion towards the posture, in the null space of the law's inverse. This motion takes only the speed that the tool's motion
    /// leaves to each joint within its limits of speed and position, so that it does not slow the tool or keep it from its goal. It waits while the arm leaves a singularity.
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
    /// Turns the `velocity` of the law, one number per joint [rad/s, prismatic: m/s], into its demand.
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
