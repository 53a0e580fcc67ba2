//! Integrates closed loops accurately: the laws alone, without the servo's limits and its cycle.

use super::PaperError;
use differential_equations::prelude::*;
use dq_algebra::UnitDualQuaternion;
use dq_core::servo::Arms;
use dq_kinematics::control::Controller;
use std::cell::RefCell;

/// The motion of a closed loop. The time between samples is [`INTERVAL`].
#[derive(Clone, Debug, PartialEq)]
pub struct Trajectory {
    /// The times of the samples \[s\].
    pub times: Vec<f64>,
    /// The integrated state at each time: joint positions \[rad\], or the six numbers of a logarithm.
    pub states: Vec<Vec<f64>>,
}

/// The time between two samples \[s\]. This time is short enough for the beginning of diffc's motion: the tool covers a third of
/// the path in the first hundredth of a second.
pub const INTERVAL: f64 = 1e-3;

/// The relative tolerance of an integration step.
const RELATIVE_TOLERANCE: f64 = 1e-9;
/// The absolute tolerance of an integration step \[rad, m\].
const ABSOLUTE_TOLERANCE: f64 = 1e-11;

/// Largest number of steps of an integration. More steps indicate an endless motion.
const MOST_STEPS: usize = 1_000_000;

/// Returns the times of the samples up to `duration` \[s\].
fn times(duration: f64) -> Vec<f64> {
    let last = (duration / INTERVAL + 1e-9) as u32;
    (0..=last).map(|count| (f64::from(count) * INTERVAL).min(duration)).collect()
}

/// Integrates `ẋ = velocity(x)` from `start` for `duration` \[s\].
///
/// # Errors
/// [`PaperError::Simulation`] if the integration fails.
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

/// Simulates one arm, or two arms, under a law for `duration` \[s\], from `start` \[rad\] toward `goal`. Does not change the sign
/// of the quaternion of `goal`, even if the other sign is nearer.
///
/// # Errors
/// [`PaperError::Simulation`] if the integration fails.
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
    /// Returns the controlled poses along the path: poses of the tool, or poses of the right tool in the left tool's frame.
    pub fn poses(&self, mut arms: Arms) -> Vec<UnitDualQuaternion> {
        let pose = |theta: &Vec<f64>| {
            arms.evaluate(theta);
            arms.pose()
        };
        self.states.iter().map(pose).collect()
    }
}
