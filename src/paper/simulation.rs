//! Closed loops integrated precisely: the laws themselves, without the servo's limits and without its cycle.

use super::PaperError;
use crate::arm::{ArmState, Chain};
use crate::control::{Controller, Cooperative};
use crate::dq::{DualQuaternion, UnitDualQuaternion, Vector8};
use differential_equations::prelude::*;
use nalgebra::Vector6;
use std::cell::RefCell;

/// What a closed loop passed through, at even times.
#[derive(Clone, Debug, PartialEq)]
pub struct Trajectory {
    /// \[s\]
    pub times: Vec<f64>,
    /// What was integrated, at each time: joint angles \[rad\], or a dual quaternion's eight numbers.
    pub states: Vec<Vec<f64>>,
}

/// How precisely, relative and absolute.
#[derive(Clone, Copy, Debug)]
pub struct Precision {
    /// Relative tolerance of a step.
    pub relative: f64,
    /// Absolute tolerance of a step.
    pub absolute: f64,
}

impl Precision {
    /// For figures and for the comparison with the reference work.
    pub const FINE: Self = Self { relative: 1e-9, absolute: 1e-11 };
    /// For thousands of runs.
    pub const COARSE: Self = Self { relative: 1e-5, absolute: 1e-7 };
}

/// For how long, and what is kept of it.
#[derive(Clone, Copy, Debug)]
pub struct Span {
    /// \[s\]
    pub duration: f64,
    /// Between two samples \[s\].
    pub interval: f64,
    /// Of the integration.
    pub precision: Precision,
}

/// Longest integration, in steps: what needs more is going round in circles.
const MOST_STEPS: usize = 1_000_000;

/// Integrates `ẋ = velocity(x)` from `start` until the span ends or `arrived` says so.
///
/// # Errors
/// [`PaperError::Simulation`] where the integration fails.
pub fn integrate(
    velocity: impl Fn(&[f64], &mut [f64]),
    start: &[f64],
    span: &Span,
    arrived: impl FnMut(&[f64]) -> bool,
) -> Result<Trajectory, PaperError> {
    let sampling = Sampling { interval: span.interval, count: 0, arrived };
    let solution = IVP::ode_from_fn(
        |_, state: &Vec<f64>, change: &mut Vec<f64>| velocity(state, change),
        0.0,
        span.duration,
        start.to_vec(),
    )
    .method(
        ExplicitRungeKutta::dopri5()
            .rtol(span.precision.relative)
            .atol(span.precision.absolute)
            .max_steps(MOST_STEPS),
    )
    .solout(sampling)
    .solve()
    .map_err(|why| PaperError::Simulation(format!("{why:?}")))?;
    let (times, states) = solution.into_tuple();
    Ok(Trajectory { times, states })
}

/// Keeps the state at even times; ends when it has arrived.
struct Sampling<F> {
    interval: f64,
    count: u32,
    arrived: F,
}

impl<F: FnMut(&[f64]) -> bool> Solout<f64, Vec<f64>> for Sampling<F> {
    fn solout<I: Interpolation<f64, Vec<f64>> + ?Sized>(
        &mut self,
        now: f64,
        _before: f64,
        state: &Vec<f64>,
        _state_before: &Vec<f64>,
        interpolator: &mut I,
        solution: &mut Solution<f64, Vec<f64>>,
    ) -> ControlFlag<f64, Vec<f64>> {
        loop {
            let time = f64::from(self.count) * self.interval;
            // The last sample is at the end, whatever rounding says.
            if time > now + 1e-9 {
                return ControlFlag::Continue;
            }
            // At the end of a step the state is known; before the first step there is nothing to interpolate.
            let sample = if time < now { interpolator.interpolate(time) } else { Ok(state.clone()) };
            let Ok(state) = sample else { return ControlFlag::Terminate };
            let arrived = (self.arrived)(&state);
            solution.push(time, state);
            self.count += 1;
            if arrived {
                return ControlFlag::Terminate;
            }
        }
    }
}

/// One arm under a law, from `start` \[rad\] towards `goal`, whose sign is taken as it is.
///
/// # Errors
/// [`PaperError::Simulation`], [`PaperError::Arm`].
pub fn follow(
    chain: &Chain,
    controller: &Controller,
    goal: &UnitDualQuaternion,
    start: &[f64],
    span: &Span,
    arrived: impl FnMut(&[f64]) -> bool,
) -> Result<Trajectory, PaperError> {
    chain.forward_kinematics(start)?;
    let state = RefCell::new(ArmState::new(chain));
    let velocity = |theta: &[f64], theta_dot: &mut [f64]| {
        let mut state = state.borrow_mut();
        // The count of the joints was checked with the start.
        if chain.evaluate(theta, &mut state).is_ok() {
            controller.joint_velocity(&state, goal, theta_dot);
        }
    };
    integrate(velocity, start, span, arrived)
}

/// Two arms under the two-arm law from `start` \[rad\], left arm first; the trajectory has the joints of both.
///
/// # Errors
/// [`PaperError::Simulation`], [`PaperError::Arm`].
pub fn follow_two(
    chains: (&Chain, &Chain),
    law: &Cooperative,
    left_from_goal: &UnitDualQuaternion,
    start: &[f64],
    span: &Span,
) -> Result<Trajectory, PaperError> {
    let velocity = |theta: &[f64], theta_dot: &mut [f64]| {
        if let Ok(arms) = two_arms(chains, theta) {
            law.joint_velocity(&arms, left_from_goal, theta_dot);
        }
    };
    two_arms(chains, start)?;
    integrate(velocity, start, span, |_| false)
}

/// The two arms as one at `theta` \[rad\], left arm first.
///
/// # Errors
/// [`PaperError::Arm`].
pub fn two_arms((left, right): (&Chain, &Chain), theta: &[f64]) -> Result<ArmState, PaperError> {
    let (of_left, of_right) = theta.split_at(left.joint_count().min(theta.len()));
    let (mut at_left, mut at_right) = (ArmState::new(left), ArmState::new(right));
    left.evaluate(of_left, &mut at_left)?;
    right.evaluate(of_right, &mut at_right)?;
    Ok(ArmState::relative(&at_left, &at_right))
}

/// A body that follows the twist that `twist` makes of its pose error, without an arm: the task space in which the paper
/// integrated logc (eq. 30). The trajectory has the eight numbers of the pose.
///
/// # Errors
/// [`PaperError::Simulation`].
pub fn follow_freely(
    twist: impl Fn(&UnitDualQuaternion) -> Vector6<f64>,
    goal: &UnitDualQuaternion,
    start: &UnitDualQuaternion,
    span: &Span,
) -> Result<Trajectory, PaperError> {
    let velocity = |numbers: &[f64], change: &mut [f64]| {
        if let Some(pose) = pose(numbers) {
            // q̇ = ½ q (ω + ε v)
            let moved =
                *pose.as_dual_quaternion() * DualQuaternion::from_vector6(&twist(&(goal.conjugate() * pose)));
            change.copy_from_slice((0.5 * moved.to_vector8()).as_slice());
        }
    };
    integrate(velocity, start.to_vector8().as_slice(), span, |_| false)
}

/// The pose nearest to eight numbers.
pub fn pose(numbers: &[f64]) -> Option<UnitDualQuaternion> {
    let vector = Vector8::from_row_slice(numbers.get(..8)?);
    UnitDualQuaternion::try_normalize(&DualQuaternion::from_vector8(&vector)).ok()
}
