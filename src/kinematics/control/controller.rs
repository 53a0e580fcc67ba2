//! A law with its gains.

use super::angular_linear::AngularLinear;
use super::control_law::{LawInput, Map};
use super::law::MOST;
use super::{Aim, Damping, Law, PoseError};
use crate::arm::ArmState;
use dq_algebra::UnitDualQuaternion;
use nalgebra::Vector6;
use std::f64::consts::FRAC_PI_2;

/// A law with its gains, and those of the others, which wait for their turn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Controller {
    /// The law in force.
    pub law: Law,
    /// What of the goal's pose it is asked for.
    pub aim: Aim,
    /// The damped inverse of the laws that use it.
    pub damping: Damping,
    /// The gains of each law, by its number.
    pub all_gains: [[f64; 2]; MOST],
}

/// How fast a delay allows a law to make errors decay.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AllowedRate {
    /// The part of the law's [fastest rate](Controller::fastest_rates) that this is; 1 and above: the law is slow enough.
    pub part: f64,
    /// The rate [1/s].
    pub largest: f64,
}

impl Default for Controller {
    /// logc with equal gains of 1/s for a whole pose, and each law's gains at their defaults.
    fn default() -> Self {
        let mut all_gains = [[0.0; 2]; MOST];
        for law in Law::all() {
            all_gains[law.number()] = law.gains().defaults;
        }
        Self { law: Law::Logc, aim: Aim::Pose, damping: Damping { max: 0.05, threshold: 0.05 }, all_gains }
    }
}

impl Controller {
    /// The law of two arms, `θ̇ = Jᵀ K e` or `θ̇ = J⁺ K e` (paper §4): with the transpose e is the difference of two positions, of two
    /// distances, of two rotations in R⁴ or of two poses in R⁸; with the inverse it is that of diffc_inverse.
    pub fn of_two_arms(map: Map, aim: Aim, gain: f64, damping: Damping) -> Self {
        let law = match (map, aim) {
            (Map::DampedInverse, _) => Law::DiffcInverse,
            (Map::Transpose, Aim::Pose | Aim::Orientation) => Law::Diffc,
            // In R⁸ there is half a position, and half of that in the transpose: here it is fed back as it is.
            (Map::Transpose, Aim::Position | Aim::PositionAndAxis | Aim::Distance) => {
                Law::UnitQuaternionTranspose
            }
        };
        Self { aim, damping, ..Self::default() }.with_law(law, gain)
    }

    /// The gains of a law; of one that has one the second is not used.
    pub fn gains(&self, law: Law) -> [f64; 2] {
        self.all_gains[law.number()]
    }

    /// Sets the gains of a law.
    pub fn set_gains(&mut self, law: Law, gains: [f64; 2]) {
        self.all_gains[law.number()] = gains;
    }

    /// This controller with those gains of that law, which is in force.
    pub fn with_gains(mut self, law: Law, gains: [f64; 2]) -> Self {
        self.set_gains(law, gains);
        Self { law, ..self }
    }

    /// This controller with `law` in force, and the one number `gain` [1/s] for what drives it: K, or equal gains; for a law with
    /// derived gains what they derive from, in the proportions that the defaults have.
    pub fn with_law(&self, law: Law, gain: f64) -> Self {
        self.with_gains(law, law.gains_at(gain, self.gains(law)))
    }

    /// The first gain of the law in force: K, or `k_ω`.
    pub fn gain(&self) -> f64 {
        self.gains(self.law)[0]
    }

    /// The gains of the law in force, each with what it is.
    pub fn describe_gains(&self) -> String {
        let each = self.law.gains().names.iter().zip(self.gains(self.law));
        each.map(|(name, gain)| format!("{name} {gain}")).collect::<Vec<_>>().join(", ")
    }

    /// Joint velocities [rad/s, prismatic: m/s] that move `arm` towards `base_from_goal`, whose sign is chosen already; written to
    /// `theta_dot`, one a joint, without allocating. `theta_dot` must have one number a joint, which is not checked: a shorter slice
    /// gets the first joints only, and the rest of a longer one is no joint of this arm's.
    pub fn joint_velocity(&self, arm: &ArmState, base_from_goal: &UnitDualQuaternion, theta_dot: &mut [f64]) {
        self.law.joint_velocity(&self.input(arm, base_from_goal), theta_dot);
    }

    #[inline(always)]
    fn input<'a>(&self, arm: &'a ArmState, base_from_goal: &'a UnitDualQuaternion) -> LawInput<'a> {
        let Self { law, aim, damping, .. } = *self;
        LawInput { arm, base_from_goal, aim, gains: self.gains(law), damping }
    }

    /// Joint velocities [rad/s, prismatic: m/s] for what is asked for of the twist `(ω, v)` [rad/s, m/s] of the tool of `arm` along the
    /// base's axes, by the damped inverse; written to `theta_dot`.
    pub fn joint_velocity_of(&self, arm: &ArmState, twist: &AngularLinear, theta_dot: &mut [f64]) {
        self.damping.joint_velocity(arm, self.aim, || *twist, theta_dot);
    }

    /// Takes out of the joint velocities `theta_dot` of `arm` what would move what is asked for.
    pub fn leave_tool(&self, arm: &ArmState, theta_dot: &mut [f64]) {
        self.damping.leave_tool(arm, self.aim, theta_dot);
    }

    /// The rate [1/s] at which the velocity [goes to](super::ControlLaw::approach_rate) the one that the law in force asks for.
    pub fn approach_rate(&self) -> f64 {
        self.law.approach_rate(self.gains(self.law))
    }

    /// The fastest rates [1/s] at which small errors of position and rotation decay with `arm` where it is. With the damped inverse they are
    /// the gains of what is asked for; with the transpose the closed loop is `δθ̇ = −Jᵀ K J δθ`, and both are `σ_max²(√K J)`. Of a law of second
    /// order they are those of the law of first order that is stable up to the same delay.
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
        rates.map(|rate| as_of_first_order(rate, self.approach_rate()))
    }

    /// Takes from the law's joint velocities `theta_dot` what a delay does not allow, with `arm` where it is: no error decays faster than
    /// `allowed`. With the damped inverse all errors decay alike, and all
    /// velocities are scaled; with the transpose only fast directions are slowed.
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

    /// The law's [steepest descent](super::ControlLaw::steepest_descent), written to `descent`. Returns the size of its error.
    pub fn steepest_descent(
        &self,
        arm: &ArmState,
        base_from_goal: &UnitDualQuaternion,
        descent: &mut [f64],
    ) -> f64 {
        self.law.steepest_descent(&self.input(arm, base_from_goal), descent)
    }

    /// The smallest singular value of the rows of the tool's Jacobian that are asked for; 0 for fewer joints than rows.
    pub fn smallest_singular_value(&self, arm: &ArmState) -> f64 {
        self.aim.rows(arm).gram(arm).smallest_singular_value()
    }

    /// The same where it is below `bound`, which costs less where it is not.
    pub fn singular_value_below(&self, bound: f64, arm: &ArmState) -> Option<f64> {
        self.aim.rows(arm).gram(arm).singular_value_below(bound)
    }

    /// Gain times error as a body twist `(ω, v)` [rad/s, m/s]: what a tool without an arm would do, and an arm does by the
    /// inverse of its Jacobian.
    pub fn body_twist(&self, goal_from_tool: &UnitDualQuaternion) -> Vector6<f64> {
        let error = PoseError::from(&goal_from_tool.inverse());
        let (angular, linear) = self.law.twist(self.gains(self.law), &error);
        Vector6::new(angular.x, angular.y, angular.z, linear.x, linear.y, linear.z)
    }
}

/// The pose error `e = q_d* q` (eq. 28): `goal_from_tool`.
pub fn pose_error(arm: &ArmState, base_from_goal: &UnitDualQuaternion) -> UnitDualQuaternion {
    base_from_goal.inverse() * arm.base_from_tool()
}

/// The rate [1/s] of the law of first order that is stable by itself up to the same delay as a law of second order, whose velocity goes at the
/// rate R to one of the rate λ: on the border of stability `s² + R s + R λ exp(−s τ)` has a root `i ω` with `tan(ω τ) = R/ω`, and of a
/// law of first order τ is `½π` by the rate.
fn as_of_first_order(rate: f64, approach: f64) -> f64 {
    if approach.is_infinite() || rate == 0.0 {
        return rate;
    }
    let (half_square, stiffness) = (0.5 * approach.powi(2), approach * rate);
    // ω² = −½R² + √(¼R⁴ + R²λ²), without its cancellation.
    let frequency = stiffness / (half_square + half_square.hypot(stiffness)).sqrt();
    FRAC_PI_2 * frequency / approach.atan2(frequency)
}
