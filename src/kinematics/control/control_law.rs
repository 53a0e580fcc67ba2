//! What a control law is.

use super::angular_linear::{AngularLinear, norm, scaled, twice};
use super::{Aim, Damping, PoseError, Stiffness};
use crate::arm::ArmState;
use dq_algebra::UnitDualQuaternion;
use dq_common::named;
use std::ops::RangeInclusive;

named! {
    /// How an error becomes joint velocities.
    "controller" Map {
        /// `Jᵀ`.
        Transpose = "transpose",
        /// `J⁺ = Jᵀ(JJᵀ + λ²I)⁻¹`.
        DampedInverse = "damped_inverse",
    }
}

/// The gains of a law: what the parameter `gains.` with its name takes.
#[derive(Clone, Debug, PartialEq)]
pub struct LawGains {
    /// What each of them is called, of one or two.
    pub names: &'static [&'static str],
    /// Their values where nobody gives any.
    pub defaults: [f64; 2],
    /// The least and the largest.
    pub range: RangeInclusive<f64>,
    /// Their unit.
    pub unit: &'static str,
    /// What they are, in a sentence.
    pub about: &'static str,
}

/// The least gain that anybody may give.
pub(super) const LEAST: f64 = 1e-6;

impl LawGains {
    /// `k_ω` and `k_v` [1/s], both `default` and at most `most`.
    pub fn twist(default: f64, most: f64) -> Self {
        Self {
            names: &["k_omega", "k_v"],
            defaults: [default; 2],
            range: LEAST..=most,
            unit: "1/s",
            about: "k_omega and k_v: gains of the angular and of the linear error",
        }
    }
}

/// What a law goes by.
#[derive(Clone, Copy)]
pub struct LawInput<'a> {
    /// The arm, or two arms as one.
    pub arm: &'a ArmState,
    /// The goal, whose sign is chosen already.
    pub base_from_goal: &'a UnitDualQuaternion,
    /// What of the goal is asked for.
    pub aim: Aim,
    /// The law's gains; of one gain the second is not used.
    pub gains: [f64; 2],
    /// The damped inverse.
    pub damping: Damping,
}

impl LawInput<'_> {
    /// Where the goal is, as far as it is asked for, along the base's axes.
    #[inline(always)]
    pub fn error(&self) -> PoseError {
        PoseError::of(self.aim, self.arm, self.base_from_goal)
    }

    /// `Jᵀ` times a twist of the tool along the base's axes: joint velocities, one a joint.
    #[inline(always)]
    pub fn transpose(&self, twist: &AngularLinear, theta_dot: &mut [f64]) {
        self.arm.apply_transpose(&twice(twist), theta_dot);
    }

    /// `J⁺` times what is asked for of a twist of the tool along the base's axes: joint velocities, one a joint.
    #[inline(always)]
    pub fn damped_inverse(&self, twist: impl FnOnce() -> AngularLinear, theta_dot: &mut [f64]) {
        self.damping.joint_velocity(self.arm, self.aim, twist, theta_dot);
    }
}

/// A control law: which error it feeds back, with which gains, by which map. [`register`](super::register) makes one of your own known
/// under its name: see the page "Your law" there.
pub trait ControlLaw: Sync {
    /// Its name in the parameter `controller`: lower-case letters, digits and underscores.
    fn name(&self) -> &'static str;

    /// The error that it feeds back: at gain 1 the twist `(ω, v)` [rad/s, m/s] that takes the tool to the goal.
    fn error(&self, error: &PoseError) -> AngularLinear;

    /// Its gains.
    fn gains(&self) -> LawGains {
        LawGains::twist(1.0, 100.0)
    }

    /// How its twist becomes joint velocities.
    fn map(&self) -> Map {
        Map::DampedInverse
    }

    /// `k_ω` and `k_v` [1/s] at this error, with its gains as they are set.
    fn twist_gains(&self, gains: [f64; 2], _error: &AngularLinear) -> [f64; 2] {
        gains
    }

    /// Its gains for the one number `gain` [1/s]: K, or equal gains; `before` they were these.
    fn gains_at(&self, gain: f64, _before: [f64; 2]) -> [f64; 2] {
        [gain; 2]
    }

    /// The rate [1/s] at which the arm's velocity goes to the one that the law asks for, see [`Approach`](super::Approach): infinite for a law
    /// of first order, which sets the velocity. With a finite one the velocity is kept from cycle to cycle, and the acceleration is set.
    fn approach_rate(&self, _gains: [f64; 2]) -> f64 {
        f64::INFINITY
    }

    /// The twist `(ω, v)` [rad/s, m/s] that the tool is to have.
    #[inline]
    fn twist(&self, gains: [f64; 2], error: &PoseError) -> AngularLinear {
        let error = self.error(error);
        scaled(self.twist_gains(gains, &error), &error)
    }

    /// Joint velocities [rad/s, prismatic: m/s] that move the arm towards the goal; written to `theta_dot`, one a joint.
    #[inline]
    fn joint_velocity(&self, input: &LawInput, theta_dot: &mut [f64]) {
        match self.map() {
            Map::Transpose => input.transpose(&self.twist(input.gains, &input.error()), theta_dot),
            Map::DampedInverse => {
                input.damped_inverse(|| self.twist(input.gains, &input.error()), theta_dot);
            }
        }
    }

    /// With the transpose: how fast errors decay where the arm is.
    fn stiffness(&self, input: &LawInput) -> Stiffness {
        stiffness_of_twist(self, input)
    }

    /// `Jᵀ e`, with the law's twist e, written to `descent`: the direction in which the joints reduce `½|e|²` fastest. Returns `|e|`.
    fn steepest_descent(&self, input: &LawInput, descent: &mut [f64]) -> f64 {
        descent_by_twist(self, input, descent)
    }
}

/// [`stiffness`](ControlLaw::stiffness) of a law that feeds back a twist.
pub(super) fn stiffness_of_twist(law: &(impl ControlLaw + ?Sized), input: &LawInput) -> Stiffness {
    let gains = law.twist_gains(input.gains, &law.error(&input.error()));
    Stiffness::of_twist(input.aim.rows(input.arm), gains)
}

/// [`steepest_descent`](ControlLaw::steepest_descent) of a law that feeds back a twist.
pub(super) fn descent_by_twist(
    law: &(impl ControlLaw + ?Sized),
    input: &LawInput,
    descent: &mut [f64],
) -> f64 {
    let twist = law.twist(input.gains, &input.error());
    input.transpose(&twist, descent);
    norm(&twist)
}
