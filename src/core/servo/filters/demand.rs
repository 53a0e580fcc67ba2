//! What the law asks of the joints where the arm is.

use super::{Given, Towards};
use crate::servo::Posture;
use dq_limits::ratio;

/// Makes of the law's velocity what it asks for: the part that delays allow, with what leads out of a singularity, follows a goal that
/// moves and goes to the posture, within the speed limits.
pub(super) struct LawDemand {
    /// What is added [rad/s, prismatic: m/s].
    more: Vec<f64>,
}

impl LawDemand {
    /// For so many joints.
    pub fn new(joints: usize) -> Self {
        Self { more: vec![0.0; joints] }
    }

    /// Adds the joint velocities at which the tool moves as its goal does.
    ///
    /// With the goal's body twist `ξ_d` and the error `e = q_d* q` (eq. 28) the tool's body twist `ξ = Ad_{e⁻¹} ξ_d − K X` leaves `−K X` as the
    /// twist of the error: it decays as towards a goal that stands.
    fn feed_forward(&mut self, given: &Given, goal: &Towards, velocity: &mut [f64]) {
        let Some(moving) = &goal.moving else { return };
        let pose = given.arms.pose();
        let twist = (pose.inverse() * moving.pose).adjoint() * moving.twist;
        let rotation = pose.rotation();
        let [angular, linear] = [0, 3].map(|first| rotation * twist.fixed_rows::<3>(first).into_owned());
        given.settings.controller.joint_velocity_of(given.arms.state(), &(angular, linear), &mut self.more);
        velocity.iter_mut().zip(&self.more).for_each(|(speed, more)| *speed += more);
    }

    /// Adds the motion towards the posture, in the null space of the law's inverse. It takes no more than the speed that the tool's own
    /// motion leaves each joint within its limits, so that the tool is not slowed either. Until a singularity is left it waits.
    fn move_to_posture(&mut self, given: &Given, goal: &Towards, velocity: &mut [f64]) {
        let Posture { positions, gain } = &given.settings.posture;
        if goal.escape.is_some() || *gain <= 0.0 || positions.is_empty() {
            return;
        }
        for ((free, wanted), position) in self.more.iter_mut().zip(positions).zip(given.joints.positions) {
            *free = gain * (wanted - position);
        }
        given.settings.controller.leave_tool(given.arms.state(), &mut self.more);
        let joints = self.more.iter().zip(&*velocity).zip(&given.settings.limits.joint_velocity);
        let shares =
            joints.map(|((free, speed), limit)| ratio((limit - speed * free.signum()).max(0.0), free.abs()));
        let share = shares.fold(1.0, f64::min);
        velocity.iter_mut().zip(&self.more).for_each(|(speed, free)| *speed += share * free);
    }
}

impl LawDemand {
    /// Changes `velocity`, one number a joint [rad/s, prismatic: m/s].
    pub fn apply(&mut self, given: &Given, velocity: &mut [f64]) {
        if let Some(goal) = &given.goal {
            given.settings.controller.soften(given.arms.state(), &goal.pose, goal.allowed, velocity);
            if let Some(escape) = goal.escape {
                escape.lead(velocity);
            }
            self.feed_forward(given, goal, velocity);
            self.move_to_posture(given, goal, velocity);
        }
        given.joints.keep_speeds(given.arms, velocity);
    }
}
