//! A law with its gains, aim and damping.

use super::angular_linear::{AngularLinear, six_numbers};
use super::control_law::{LawInput, Map};
use super::law::MOST;
use super::{Aim, Damping, Law, PoseError};
use crate::arm::ArmState;
use dq_algebra::UnitDualQuaternion;
use nalgebra::Vector6;

/// A control law with its aim and damping, and the gains of all laws.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Controller {
    /// The present law.
    pub law: Law,
    /// The components of the pose that a goal determines.
    pub aim: Aim,
    /// The damping of the inverse. Laws with the transpose do not use it.
    pub damping: Damping,
    /// The gains that were set, by the index of the law. A law without an entry has its default gains.
    pub set_gains: [Option<[f64; 2]>; MOST],
}

/// The largest rate at which errors may decay, given the delay of the robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AllowedRate {
    /// The allowed rate divided by the law's [fastest rate](Controller::fastest_rates). At 1 or more, the law is slow enough.
    pub part: f64,
    /// The allowed rate [1/s].
    pub largest: f64,
}

impl Default for Controller {
    /// Creates logc with a whole pose as its aim. Each law has its default gains: for logc, both gains are 1 [1/s].
    fn default() -> Self {
        let damping = Damping { max: 0.05, threshold: 0.05 };
        Self { law: Law::Logc, aim: Aim::Pose, damping, set_gains: [None; MOST] }
    }
}

impl Controller {
    /// Creates the controller of two arms, with the law `θ̇ = Jᵀ K e` or `θ̇ = J⁺ K e` (paper §4). With the transpose, the error e
    /// depends on `aim`: it is the difference of two positions, two distances, two rotations in R⁴ or two poses in R⁸. With the
    /// inverse, e is the error of diffc_inverse.
    pub fn of_two_arms(map: Map, aim: Aim, gain: f64, damping: Damping) -> Self {
        let law = match (map, aim) {
            (Map::DampedInverse, _) => Law::DiffcInverse,
            (Map::Transpose, Aim::Pose | Aim::Orientation) => Law::Diffc,
            // The dual part in R⁸ is half a position, and the transpose halves it again. This law feeds the position back without
            // these factors.
            (Map::Transpose, Aim::Position | Aim::PositionAndAxis | Aim::Distance) => {
                Law::UnitQuaternionTranspose
            }
        };
        Self { aim, damping, ..Self::default() }.with_law(law, gain)
    }

    /// Returns the gains of `law`; if the law has one gain, the second number has no meaning.
    pub fn gains(&self, law: Law) -> [f64; 2] {
        self.set_gains[law.number()].unwrap_or_else(|| law.gains().defaults)
    }

    /// Sets the gains of a law.
    pub fn set_gains(&mut self, law: Law, gains: [f64; 2]) {
        self.set_gains[law.number()] = Some(gains);
    }

    /// Returns a copy of this controller whose present law is `law`, with these gains.
    pub fn with_gains(mut self, law: Law, gains: [f64; 2]) -> Self {
        self.set_gains(law, gains);
        Self { law, ..self }
    }

    /// Returns a copy of this controller whose present law is `law`, with the gains that correspond to the single gain `gain`
    /// [1/s]: K, or equal angular and linear gains. A law with derived gains derives them from `gain`
    /// ([`gains_at`](super::ControlLaw::gains_at)).
    pub fn with_law(&self, law: Law, gain: f64) -> Self {
        self.with_gains(law, law.gains_at(gain, self.gains(law)))
    }

    /// Returns the first gain of the present law: K, or `k_ω`.
    pub fn gain(&self) -> f64 {
        self.gains(self.law)[0]
    }

    /// Describes the gains of the present law in words, with their names.
    pub fn describe_gains(&self) -> String {
        let each = self.law.gains().names.iter().zip(self.gains(self.law));
        each.map(|(name, gain)| format!("{name} {gain}")).collect::<Vec<_>>().join(", ")
    }

    /// Sets `theta_dot` to joint velocities [rad/s, prismatic: m/s] that move `arm` toward `base_from_goal`. The sign of the goal's
    /// quaternion decides between two rotations: see [`nearer_goal`](super::nearer_goal). Ignores the memory of a law that has one:
    /// see [`LawMemory`](super::LawMemory). Does not allocate.
    ///
    /// The caller must pass a `theta_dot` with one number per joint. This is not checked: a shorter slice gets the velocities of the
    /// first joints only, and the end of a longer slice is undefined.
    pub fn joint_velocity(&self, arm: &ArmState, base_from_goal: &UnitDualQuaternion, theta_dot: &mut [f64]) {
        self.law.joint_velocity(&self.input(arm, base_from_goal), theta_dot);
    }

    #[inline(always)]
    pub(super) fn input<'a>(
        &self,
        arm: &'a ArmState,
        base_from_goal: &'a UnitDualQuaternion,
    ) -> LawInput<'a> {
        let Self { law, aim, damping, .. } = *self;
        LawInput { arm, base_from_goal, aim, gains: self.gains(law), damping }
    }

    /// Sets `theta_dot` to the joint velocities [rad/s, prismatic: m/s] that move the tool of `arm` with `twist`, by the damped
    /// inverse. `twist` is `(ω, v)` [rad/s, m/s], along the base's axes. Components of `twist` that the aim leaves free are ignored.
    pub fn joint_velocity_of(&self, arm: &ArmState, twist: &AngularLinear, theta_dot: &mut [f64]) {
        self.damping.joint_velocity(arm, self.aim, || *twist, theta_dot);
    }

    /// Removes, from the joint velocities `theta_dot` of `arm`, the part that would move the tool in the components that the aim
    /// determines.
    pub fn leave_tool(&self, arm: &ArmState, theta_dot: &mut [f64]) {
        self.aim.leave_tool(arm, theta_dot);
    }

    /// Returns the fastest rates [1/s] at which small errors decay at the pose of `arm`: first the rate of the position, then the
    /// rate of the rotation.
    ///
    /// - Damped inverse: the law's gains, or 0 for a component that the aim leaves free.
    /// - Transpose: the closed loop is `δθ̇ = −Jᵀ K J δθ` with the gains K and the Jacobian J. Both rates are the square of the
    ///   largest singular value of `√K J`.
    ///
    /// A law with a memory converts these rates by its [`rates_for_delay`](super::ControlLaw::rates_for_delay).
    pub fn fastest_rates(&self, arm: &ArmState, base_from_goal: &UnitDualQuaternion) -> [f64; 2] {
        let (law, input) = (self.law, self.input(arm, base_from_goal));
        let rates = match law.map() {
            Map::Transpose => [law.stiffness(&input).fastest_rate(arm); 2],
            Map::DampedInverse => {
                let [angular, linear] = law.twist_gains(input.gains, &law.error(&input.error()));
                match self.aim {
                    Aim::Pose | Aim::PositionAndAxis => [linear, angular],
                    Aim::Position | Aim::Distance => [linear, 0.0],
                    Aim::Orientation => [0.0, angular],
                }
            }
        };
        law.rates_for_delay(input.gains, rates)
    }

    /// Reduces the law's joint velocities `theta_dot` at the pose of `arm`, so that no error decays faster than at the rate
    /// `allowed`. With the damped inverse, all errors decay at similar rates, so all velocities are scaled. With the transpose,
    /// only the directions in which errors decay fast are slowed.
    pub fn soften(
        &self,
        arm: &ArmState,
        base_from_goal: &UnitDualQuaternion,
        allowed: AllowedRate,
        theta_dot: &mut [f64],
    ) {
        let AllowedRate { part, largest } = allowed;
        if part >= 1.0 {
            return;
        }
        match self.law.map() {
            Map::DampedInverse => theta_dot.iter_mut().for_each(|speed| *speed *= part),
            Map::Transpose => {
                let stiffness = self.law.stiffness(&self.input(arm, base_from_goal));
                stiffness.soften(arm, (1.0 - part) / largest, theta_dot);
            }
        }
    }

    /// Sets `descent` to the law's [steepest descent](super::ControlLaw::steepest_descent). Returns the size of the law's error.
    pub fn steepest_descent(
        &self,
        arm: &ArmState,
        base_from_goal: &UnitDualQuaternion,
        descent: &mut [f64],
    ) -> f64 {
        self.law.steepest_descent(&self.input(arm, base_from_goal), descent)
    }

    /// Returns the smallest singular value of the rows of the tool's Jacobian that belong to the aim. It is 0 if there are fewer
    /// joints than rows.
    pub fn smallest_singular_value(&self, arm: &ArmState) -> f64 {
        self.aim.rows(arm).gram(arm).smallest_singular_value()
    }

    /// Returns the [`smallest_singular_value`](Self::smallest_singular_value) if it is below `bound`, otherwise `None`. This is fast
    /// in the usual case, in which the result is `None`.
    pub fn singular_value_below(&self, bound: f64, arm: &ArmState) -> Option<f64> {
        self.aim.rows(arm).gram(arm).singular_value_below(bound)
    }

    /// Returns the law's desired twist of the tool, `(ω, v)` [rad/s, m/s], along the tool's axes: gain times error. A free tool
    /// would move with this twist. An arm follows the twist by the inverse of its Jacobian.
    pub fn body_twist(&self, goal_from_tool: &UnitDualQuaternion) -> Vector6<f64> {
        let error = PoseError::from(&goal_from_tool.inverse());
        six_numbers(&self.law.twist(self.gains(self.law), &error)).into()
    }
}

/// Returns the pose error `e = q_d* q` (eq. 28), which is `goal_from_tool`.
pub fn pose_error(arm: &ArmState, base_from_goal: &UnitDualQuaternion) -> UnitDualQuaternion {
    base_from_goal.inverse() * arm.base_from_tool()
}
