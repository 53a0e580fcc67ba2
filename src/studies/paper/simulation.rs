//! Closed loops integrated precisely: the laws themselves, without the servo's limits and without its cycle.

use super::PaperError;
use differential_equations::prelude::*;
use dq_algebra::UnitDualQuaternion;
use dq_core::servo::Arms;
use dq_kinematics::control::Controller;
use std::cell::RefCell;

/// What a closed loop passed through, [`INTERVAL`] from sample to sample.
#[derive(Clone, Debug, PartialEq)]
pub struct Trajectory {
    /// The samples' times \[s\].
    pub times: Vec<f64>,
    /// What was integrated, at each of the times: joint angles \[rad\], or the six numbers of a logarithm.
    pub states: Vec<Vec<f64>>,
}

/// The time between two samples \[s\]: fine enough for diffc's first hundredth of a second, in which it goes a third of its way.
pub const INTERVAL: f64 = 1e-3;

/// Tolerances of an integration step: for figures and for the comparison with the reference work.
const RELATIVE_TOLERANCE: f64 = 1e-9;
const ABSOLUTE_TOLERANCE: f64 = 1e-11;

/// Longest integration, in steps: what needs more is going round in circles.
const MOST_STEPS: usize = 1_000_000;

/// The samples' times; the last one is at the end, whatever rounding says.
fn times(duration: f64) -> Vec<f64> {
    let last = (duration / INTERVAL + 1e-9) as u32;
    (0..=last).map(|count| (f64::from(count) * INTERVAL).min(duration)).collect()
}

/// Integrates `ẋ = velocity(x)` from `start` for `duration` \[s\].
///
/// # Errors
/// [`PaperError::Simulation`] where the integration fails.
pub fn integrate(
    velocity: impl Fn(&[f64], &mut [f64]),
    start: &[f64],
    duration: f64,
) -> Result<Trajectory, PaperError> {
    let method = ExplicitRungeKutta::dopri5().rtol(RELATIVE_TOLERANCE).atol(ABSOLUTE_TOLERANCE);
    let solution = IVP::ode_from_fn(
        |_, state: &Vec<f64>, change: &mut Vec<f64>| velocity(state, change),
        0.0,
        duration,
        start.to_vec(),
    )
    .method(method.max_steps(MOST_STEPS))
    .t_eval(times(duration))
    .solve()
    .map_err(|why| PaperError::Simulation(format!("{why:?}")))?;
    let (times, states) = solution.into_tuple();
    Ok(Trajectory { times, states })
}

/// One arm or two under a law, from `start` \[rad\] towards `goal`, whose sign is taken as it is, for `duration` \[s\].
///
/// # Errors
/// [`PaperError::Simulation`].
pub fn follow(
    arms: Arms,
    controller: &Controller,
    goal: &UnitDualQuaternion,
    start: &[f64],
    duration: f64,
) -> Result<Trajectory, PaperError> {
    let arms = RefCell::new(arms);
    let velocity = |theta: &[f64], theta_dot: &mut [f64]| {
        let mut arms = arms.borrow_mut();
        arms.evaluate(theta);
        controller.joint_velocity(arms.state(), goal, theta_dot);
    };
    integrate(velocity, start, duration)
}

impl Trajectory {
    /// The controlled poses along the way: the tool's, or the right tool's in the left tool's frame.
    pub fn poses(&self, mut arms: Arms) -> Vec<UnitDualQuaternion> {
        let pose = |theta: &Vec<f64>| {
            arms.evaluate(theta);
            arms.pose()
        };
        self.states.iter().map(pose).collect()
    }
}
