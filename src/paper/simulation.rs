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

/// Relative and absolute tolerance of an integration step: for figures and for the comparison with the reference work.
const PRECISION: (f64, f64) = (1e-9, 1e-11);

/// Longest integration, in steps: what needs more is going round in circles.
const MOST_STEPS: usize = 1_000_000;

/// For how long a loop is followed, and when a sample of it is kept.
#[derive(Clone, Copy, Debug)]
pub struct Span {
    /// How long the loop is followed \[s\].
    pub duration: f64,
    /// The time between two samples \[s\].
    pub interval: f64,
}

impl Span {
    fn times(&self) -> Vec<f64> {
        // The last sample is at the end, whatever rounding says.
        let last = (self.duration / self.interval + 1e-9) as u32;
        (0..=last).map(|count| (f64::from(count) * self.interval).min(self.duration)).collect()
    }
}

/// Integrates `ẋ = velocity(x)` from `start` until the span ends.
///
/// # Errors
/// [`PaperError::Simulation`] where the integration fails.
pub fn integrate(
    velocity: impl Fn(&[f64], &mut [f64]),
    start: &[f64],
    span: &Span,
) -> Result<Trajectory, PaperError> {
    let (relative, absolute) = PRECISION;
    let solution = IVP::ode_from_fn(
        |_, state: &Vec<f64>, change: &mut Vec<f64>| velocity(state, change),
        0.0,
        span.duration,
        start.to_vec(),
    )
    .method(ExplicitRungeKutta::dopri5().rtol(relative).atol(absolute).max_steps(MOST_STEPS))
    .t_eval(span.times())
    .solve()
    .map_err(|why| PaperError::Simulation(format!("{why:?}")))?;
    let (times, states) = solution.into_tuple();
    Ok(Trajectory { times, states })
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
    integrate(velocity, start, span)
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
    integrate(velocity, start, span)
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
