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
        /// The transposed Jacobian `Jᵀ`.
        Transpose = "transpose",
        /// The damped inverse of the Jacobian, `J⁺ = Jᵀ(JJᵀ + λ²I)⁻¹`.
        DampedInverse = "damped_inverse",
    }
}

/// The names, defaults, range and unit of a law's gains. They declare the parameter `gains.<law>`.
#[derive(Clone, Debug, PartialEq)]
pub struct LawGains {
    /// The names of the gains: one or two names.
    pub names: &'static [&'static str],
    /// The default values of the gains.
    pub defaults: [f64; 2],
    /// The least and the largest value of the gains.
    pub range: RangeInclusive<f64>,
    /// The unit of the gains.
    pub unit: &'static str,
    /// A description of the gains in one sentence.
    pub about: &'static str,
}

/// The smallest allowed gain.
pub(super) const LEAST: f64 = 1e-6;

impl LawGains {
    /// Describes two gains `k_ω` and `k_v` [1/s]. Both have the default `default`, and are at most `most`.
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

/// The size of the largest memory that a law can have: how many numbers it can keep from cycle to cycle.
pub const MEMORY: usize = 24;

/// The input that a [law with a memory](super::LawMemory) gets in each cycle. All vectors are along the tool's axes.
#[derive(Clone, Copy, Debug)]
pub struct ToolMotion {
    /// The law's gains; a law with one gain ignores the second number.
    pub gains: [f64; 2],
    /// The goal relative to the tool. Components that the [`Aim`] leaves free are 0.
    pub error: PoseError,
    /// The twist `(ω, v)` that the previous command gives the tool [rad/s, m/s].
    pub twist: AngularLinear,
    /// The time since the previous cycle \[s\].
    pub period: f64,
}

/// The input of a law.
#[derive(Clone, Copy)]
pub struct LawInput<'a> {
    /// The arm, or two arms as one.
    pub arm: &'a ArmState,
    /// The goal. Its quaternion has the sign that [`SignMemory`](super::SignMemory) or [`nearer_goal`](super::nearer_goal) has
    /// chosen.
    pub base_from_goal: &'a UnitDualQuaternion,
    /// The components of the pose that the goal determines.
    pub aim: Aim,
    /// The law's gains; a law with one gain ignores the second number.
    pub gains: [f64; 2],
    /// The damping of the inverse. A law with the transpose does not use it.
    pub damping: Damping,
}

impl LawInput<'_> {
    /// Returns the tool's error with respect to the goal, along the base's axes. Components that the [`Aim`] leaves free are 0.
    #[inline(always)]
    pub fn error(&self) -> PoseError {
        PoseError::of(self.aim, self.arm, self.base_from_goal)
    }

    /// Sets `theta_dot` to `Jᵀ` times `twist`, a twist of the tool along the base's axes.
    #[inline(always)]
    pub fn transpose(&self, twist: &AngularLinear, theta_dot: &mut [f64]) {
        self.arm.apply_transpose(&twice(twist), theta_dot);
    }

    /// Sets `theta_dot` to `J⁺` times `twist`, a twist of the tool along the base's axes. Components of `twist` that the [`Aim`]
    /// leaves free are ignored.
    #[inline(always)]
    pub fn damped_inverse(&self, twist: impl FnOnce() -> AngularLinear, theta_dot: &mut [f64]) {
        self.damping.joint_velocity(self.arm, self.aim, twist, theta_dot);
    }
}

/// A control law: the error that it feeds back, its gains, and its map to joint velocities. [`register`](super::register) adds your
/// own law; its section "Your law" shows how.
pub trait ControlLaw: Sync {
    /// Returns the law's name in the parameter `controller`: lower-case letters, digits and underscores.
    fn name(&self) -> &'static str;

    /// Returns the error that the law feeds back, as a twist `(ω, v)` [rad, m] along the same axes as `error`. If both gains are 1
    /// [1/s], this error is the twist [rad/s, m/s] with which the law moves the tool toward the goal.
    fn error(&self, error: &PoseError) -> AngularLinear;

    /// Returns the names, defaults, range and unit of the law's gains.
    fn gains(&self) -> LawGains {
        LawGains::twist(1.0, 100.0)
    }

    /// Returns the map from the law's twist to joint velocities.
    fn map(&self) -> Map {
        Map::DampedInverse
    }

    /// Returns the gains `k_ω` and `k_v` [1/s] that multiply this `_error`. `gains` are the present values of the law's parameter.
    fn twist_gains(&self, gains: [f64; 2], _error: &AngularLinear) -> [f64; 2] {
        gains
    }

    /// Returns the values of the law's gains that correspond to the single gain `gain` [1/s]. By default, each gain of the law
    /// gets this value. `_before` are the law's gains so far.
    fn gains_at(&self, gain: f64, _before: [f64; 2]) -> [f64; 2] {
        [gain; 2]
    }

    /// Returns how many numbers the law remembers from cycle to cycle during a motion, at most [`MEMORY`]. A law with a memory
    /// implements [`twist_with_memory`](Self::twist_with_memory).
    fn memory_size(&self) -> usize {
        0
    }

    /// Sets the `memory` at the beginning of a motion. `_motion` is the law's input in the first cycle of the motion.
    fn begin(&self, _motion: &ToolMotion, memory: &mut [f64]) {
        memory.fill(0.0);
    }

    /// Returns the desired twist of the tool `(ω, v)` [rad/s, m/s], along the tool's axes, and updates the `_memory`. The servo
    /// calls this only for a law with a memory. The same input and the same memory must give the same twist, because the servo may
    /// evaluate a cycle several times.
    fn twist_with_memory(&self, motion: &ToolMotion, _memory: &mut [f64]) -> AngularLinear {
        self.twist(motion.gains, &motion.error)
    }

    /// Returns the rates [1/s] that the servo compares with the largest rate that is stable at the robot's delay. A law without a
    /// memory returns `rates`, which follow from [`twist_gains`](Self::twist_gains). A law with a memory returns equivalent rates:
    /// with these rates, a law without a memory becomes unstable at the same delay as this law.
    fn rates_for_delay(&self, _gains: [f64; 2], rates: [f64; 2]) -> [f64; 2] {
        rates
    }

    /// Returns the desired twist of the tool `(ω, v)` [rad/s, m/s], along the same axes as `error`. For a law with a memory, this
    /// is the twist without regard to the memory.
    #[inline]
    fn twist(&self, gains: [f64; 2], error: &PoseError) -> AngularLinear {
        let error = self.error(error);
        scaled(self.twist_gains(gains, &error), &error)
    }

    /// Sets `theta_dot` to joint velocities [rad/s, prismatic: m/s] that move the arm toward the goal.
    #[inline]
    fn joint_velocity(&self, input: &LawInput, theta_dot: &mut [f64]) {
        match self.map() {
            Map::Transpose => input.transpose(&self.twist(input.gains, &input.error()), theta_dot),
            Map::DampedInverse => {
                input.damped_inverse(|| self.twist(input.gains, &input.error()), theta_dot);
            }
        }
    }

    /// Returns the [`Stiffness`] of the closed loop at the present joint positions. The stiffness determines how fast errors decay.
    /// The controller uses it only for laws with the transpose.
    fn stiffness(&self, input: &LawInput) -> Stiffness {
        stiffness_of_twist(self, input)
    }

    /// Sets `descent` to `Jᵀ e` with the law's twist e. In this direction the joints reduce `½|e|²` fastest. Returns `|e|`.
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
