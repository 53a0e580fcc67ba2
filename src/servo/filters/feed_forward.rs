//! The velocity of a goal that moves.

use super::{Filter, Given};

/// Adds the joint velocities at which the tool moves as its goal does.
///
/// With the goal's body twist `ξ_d` and the error `e = q_d* q` (eq. 28) the tool's body twist `ξ = Ad_{e⁻¹} ξ_d − K X` leaves `−K X` as the
/// twist of the error: it decays as towards a goal that stands.
pub(super) struct FeedForward {
    joint_velocity: Vec<f64>,
}

impl FeedForward {
    /// For so many joints.
    pub fn new(joints: usize) -> Self {
        Self { joint_velocity: vec![0.0; joints] }
    }
}

impl Filter for FeedForward {
    fn apply(&mut self, given: &Given, velocity: &mut [f64]) {
        let Some(goal) = given.goal.as_ref().and_then(|goal| goal.moving.as_ref()) else { return };
        let pose = given.arms.pose();
        let tool_from_goal = pose.conjugate() * goal.pose;
        let twist = tool_from_goal.adjoint() * goal.twist;
        let (angular, linear) =
            (twist.fixed_rows::<3>(0).into_owned(), twist.fixed_rows::<3>(3).into_owned());
        let (rotation, more) = (pose.rotation(), &mut self.joint_velocity);
        let controller = &given.settings.controller;
        controller.joint_velocity_of(given.arms.state(), &(rotation * angular, rotation * linear), more);
        velocity.iter_mut().zip(more).for_each(|(speed, more)| *speed += *more);
    }
}
