//! The control law: its trait, its input, and its gains.

use super::angular_linear::{AngularLinear, norm, scaled, twice};
use super::{Aim, Damping, PoseError, Stiffness};
use crate::arm::ArmState;
use dq_algebra::UnitDualQuaternion;
use dq_common::named;
use std::ops::RangeInclusive;

named! {
    /// The map from an error to joint velocities.
    "controller" Map {
        /// `Jᵀ`.
        Transpose = "transpose",
        /// `J⁺ = Jᵀ(JJᵀ + λ²I)⁻¹`.
        DampedInverse = "damped_inverse",
    }
}

/// The description of a law's gains, with which the parameter `gains.<law>` is declared.
#[derive(Clone, Debug, PartialEq)]
pub struct LawGains {
    /// The names of its one or two gains.
    pub names: &'static [&'static str],
    /// Their default values.
    pub defaults: [f64; 2],
    /// The least and the largest value.
    pub range: RangeInclusive<f64>,
    /// Their unit.
    pub unit: &'static str,
    /// A description in one sentence.
    pub about: &'static str,
}

/// The smallest allowed gain.
pub(super) const LEAST: f64 = 1e-6;

impl LawGains {
    /// Creates `k_ω` and `k_v` [1/s], both `default` and at most `most`.
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

/// The input of a law.
#[derive(Clone, Copy)]
pub struct LawInput<'a> {
    /// The arm, or two arms as one.
    pub arm: &'a ArmState,
    /// The goal, with the chosen sign.
    pub base_from_goal: &'a UnitDualQuaternion,
    /// The components that the goal determines.
    pub aim: Aim,
    /// The law's gains; a law with one gain ignores the second.
    pub gains: [f64; 2],
    /// The damped inverse.
    pub damping: Damping,
}

impl LawInput<'_> {
    /// Returns the error with respect to the goal, within the aim, along the base's axes.
    #[inline(always)]
    pub fn error(&self) -> PoseError {
        PoseError::of(self.aim, self.arm, self.base_from_goal)
    }

    /// Writes `Jᵀ` times a twist of the tool, along the base's axes, to `theta_dot`, one number per joint.
    #[inline(always)]
    pub fn transpose(&self, twist: &AngularLinear, theta_dot: &mut [f64]) {
        self.arm.apply_transpose(&twice(twist), theta_dot);
    }

    /// Writes `J⁺` times the component within the aim of a twist of the tool, along the base's axes, to `theta_dot`, one number per joint.
    #[inline(always)]
    pub fn damped_inverse(&self, twist: impl FnOnce() -> AngularLinear, theta_dot: &mut [f64]) {
        self.damping.joint_velocity(self.arm, self.aim, twist, theta_dot);
    }
}

/// A control law: the error that it feeds back, its gains, and its map to joint velocities. [`register`](super::register) adds a law of
/// your own; the page "Your law" there shows how.
pub trait ControlLaw: Sync {
    /// Its name in the parameter `controller`: lower-case letters, digits and underscores.
    fn name(&self) -> &'static str;

    /// Returns the error that the law feeds back: at gain 1 the twist `(ω, v)` [rad/s, m/s] that takes the tool to the goal.
    fn error(&self, error: &PoseError) -> AngularLinear;

    /// Returns its gains.
    fn gains(&self) -> LawGains {
        LawGains::twist(1.0, 100.0)
    }

    /// Returns the map from its twist to joint velocities.
    fn map(&self) -> Map {
        Map::DampedInverse
    }

    /// Returns `k_ω` and `k_v` [1/s] at this error, for the present `gains`.
    fn twist_gains(&self, gains: [f64; 2], _error: &AngularLinear) -> [f64; 2] {
        gains
    }

    /// Returns the gains of this law for the single overall gain `gain` [1/s], which stands for K, or for equal angular and linear gains.
    /// `before` are the present gains.
    fn gains_at(&self, gain: f64, _before: [f64; 2]) -> [f64; 2] {
        [gain; 2]
    }

    /// Returns the rate [1/s] at which the arm's velocity approaches that of the law, see [`Approach`](super::Approach). It is infinite for
    /// a first-order law, which sets the velocity. With a finite rate the velocity is kept from cycle to cycle, and the law sets the
    /// acceleration.
    fn approach_rate(&self, _gains: [f64; 2]) -> f64 {
        f64::INFINITY
    }

    /// Returns the desired twist of the tool `(ω, v)` [rad/s, m/s].
    #[inline]
    fn twist(&self, gains: [f64; 2], error: &PoseError) -> AngularLinear {
        let error = self.error(error);
        scaled(self.twist_gains(gains, &error), &error)
    }

    /// Computes joint velocities [rad/s, prismatic: m/s] that move the arm towards the goal, and writes them to `theta_dot`, one per joint.
    #[inline]
    fn joint_velocity(&self, input: &LawInput, theta_dot: &mut [f64]) {
        match self.map() {
            Map::Transpose => input.transpose(&self.twist(input.gains, &input.error()), theta_dot),
            Map::DampedInverse => {
                input.damped_inverse(|| self.twist(input.gains, &input.error()), theta_dot);
            }
        }
    }

    /// Returns the [`Stiffness`] at the present positions, from which follows how fast errors decay. Only used for laws with the transpose.
    fn stiffness(&self, input: &LawInput) -> Stiffness {
        stiffness_of_twist(self, input)
    }

    /// Computes `Jᵀ e` with the law's twist e, and writes it to `descent`: the direction in which the joints reduce `½|e|²` fastest.
    /// Returns `|e|`.
    fn steepest_descent(&self, input: &LawInput, descent: &mut [f64]) -> f64 {
        descent_by_twist(self, input, descent)
    }
}

/// Returns the [`stiffness`](ControlLaw::stiffness) of a law that feeds back a twist.
pub(super) fn stiffness_of_twist(law: &(impl ControlLaw + ?Sized), input: &LawInput) -> Stiffness {
    let gains = law.twist_gains(input.gains, &law.error(&input.error()));
    Stiffness::of_twist(input.aim.rows(input.arm), gains)
}

/// Computes the [`steepest_descent`](ControlLaw::steepest_descent) of a law that feeds back a twist.
pub(super) fn descent_by_twist(
    law: &(impl ControlLaw + ?Sized),
    input: &LawInput,
    descent: &mut [f64],
) -> f64 {
    let twist = law.twist(input.gains, &input.error());
    input.transpose(&twist, descent);
    norm(&twist)
}
