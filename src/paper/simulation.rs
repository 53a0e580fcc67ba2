//! Closed loops integrated precisely: the laws themselves, without the servo's limits and without its cycle.

use super::PaperError;
use crate::arm::{ArmState, Chain};
use crate::control::{Controller, Cooperative};
use crate::dq::UnitDualQuaternion;
use differential_equations::prelude::*;
use std::cell::RefCell;

/// What a closed loop passed through.
#[derive(Clone, Debug, PartialEq)]
pub struct Trajectory {
    /// The samples' times \[s\].
    pub times: Vec<f64>,
    /// What was integrated, at each of the times: joint angles \[rad\], or the six numbers of a logarithm.
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
    /// How long the loop is followed \[s\].
    pub duration: f64,
    /// The time between two samples, or the longest one if they follow the integrator's steps \[s\].
    pub interval: f64,
    /// Into how many parts at least each of the integrator's steps is cut by samples, which so are close where the motion is
    /// fast; 0: samples are at even times.
    pub parts_of_steps: u32,
    /// How precisely the loop is integrated.
    pub precision: Precision,
}

impl Span {
    /// Samples at even times, precise enough for figures.
    pub fn even(duration: f64, interval: f64) -> Self {
        Self { duration, interval, parts_of_steps: 0, precision: Precision::FINE }
    }
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
    let sampling = Sampling { span: *span, count: 0, arrived };
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

/// Keeps the state at the span's times; ends when it has arrived.
struct Sampling<F> {
    span: Span,
    count: u32,
    arrived: F,
}

impl<F> Sampling<F> {
    /// The times of the samples of a step that has come from `before` to `now` \[s\].
    fn times(&mut self, before: f64, now: f64) -> Vec<f64> {
        let interval = self.span.interval;
        if self.span.parts_of_steps == 0 {
            // The last sample is at the end, whatever rounding says.
            let due = |count: &u32| f64::from(*count) * interval <= now + 1e-9;
            let first = self.count;
            self.count = (first..).find(|count| !due(count)).unwrap_or(first);
            return (first..self.count).map(|count| f64::from(count) * interval).collect();
        }
        let parts = ((now - before) / interval).ceil().max(f64::from(self.span.parts_of_steps)) as u32;
        match now > before {
            true => {
                (1..=parts).map(|part| before + (now - before) * f64::from(part) / f64::from(parts)).collect()
            }
            false => vec![now],
        }
    }
}

impl<F: FnMut(&[f64]) -> bool> Solout<f64, Vec<f64>> for Sampling<F> {
    fn solout<I: Interpolation<f64, Vec<f64>> + ?Sized>(
        &mut self,
        now: f64,
        before: f64,
        state: &Vec<f64>,
        _state_before: &Vec<f64>,
        interpolator: &mut I,
        solution: &mut Solution<f64, Vec<f64>>,
    ) -> ControlFlag<f64, Vec<f64>> {
        for time in self.times(before, now) {
            // At the end of a step the state is known; before the first step there is nothing to interpolate.
            let sample = if time < now { interpolator.interpolate(time) } else { Ok(state.clone()) };
            let Ok(state) = sample else { return ControlFlag::Terminate };
            let arrived = (self.arrived)(&state);
            solution.push(time, state);
            if arrived {
                return ControlFlag::Terminate;
            }
        }
        ControlFlag::Continue
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
