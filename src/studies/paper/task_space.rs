//! Integrates logc in task space, as the paper did for its figures 4, 5 (red) and 9: on the half-log pair, without an arm.

use super::simulation::integrate;
use super::{Laboratory, PaperError};
use dq_algebra::{UnitDualQuaternion, log_coefficients};
use dq_kinematics::control::nearer_goal;
use dq_metrics::Settling;
use nalgebra::{Vector3, Vector6};
use serde::Serialize;
use std::time::Duration;

/// The motion of logc in task space. The time between samples is [`INTERVAL`](super::INTERVAL).
#[derive(Clone, Debug)]
pub struct TaskSpaceLogc {
    /// The times of the samples \[s\].
    pub times: Vec<f64>,
    /// The half-log pair `X = (ψ, x)` of the error (eq. 32) \[rad, m\].
    pub half_logs: Vec<Vector6<f64>>,
    /// The poses that the figures show: `q_d exp(X)`, with the exponential of the half-log pair.
    pub poses: Vec<UnitDualQuaternion>,
    /// The goal `q_d`.
    pub goal: UnitDualQuaternion,
}

/// The metrics of a motion in task space, among them those of figure 4 of the paper.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TaskSpaceMetrics {
    /// The half-log pair `X` of the error at the start (see [`TaskSpaceLogc::half_logs`]) \[rad, m\].
    pub initial: [f64; 6],
    /// The time from which each component of the half-log pair stays within 1e-3 of zero \[s\]. `None` if the component does not
    /// stay within 1e-3 of zero, or was never farther from zero.
    pub last_crossing_s: [Option<f64>; 6],
    /// The time from which the rotation error stays below 2 % of its initial value \[s\]; `None` if there is no such time.
    #[serde(rename = "settling_time_2_percent_rotation_s")]
    pub settling_time_rotation: Option<f64>,
    /// The time from which the translation error stays below 2 % of its initial value \[s\]; `None` if there is no such time.
    #[serde(rename = "settling_time_2_percent_position_s")]
    pub settling_time_position: Option<f64>,
    /// The path length of the tool divided by the distance from start to goal.
    pub path_ratio: f64,
}

/// Returns the rate of the half-log pair `X = (ψ, x)` under `V = −(k_ω ψ, (k_ω + k_v) x)`: `Ẋ = V + ½ ad_X V + β ad_X² V` (Bullo &
/// Murray 1995). The rate is computed as in the paper's notebooks: the exponential coordinates are half the rotation vector and
/// half the translation.
///
/// Explicitly: `ψ̇ = −k_ω ψ`, `ẋ = −(k_ω + k_v) x − k_v (½ ψ×x + β ψ×(ψ×x))`, `β = (1 − (|ψ|/2) cot(|ψ|/2))/|ψ|²`. The notebooks
/// have the form `ẋ = −(k_ω + k_v R_ψ A_ψ⁻¹) x`, with the rotation `R_ψ` by ψ, and `A_ψ = ∫₀¹ R_sψ ds`. So with equal gains
/// the translation decays faster than the rotation.
pub fn half_log_rate([k_omega, k_v]: [f64; 2], half_log: &Vector6<f64>) -> Vector6<f64> {
    let psi: Vector3<f64> = half_log.fixed_rows::<3>(0).into();
    let x: Vector3<f64> = half_log.fixed_rows::<3>(3).into();
    let angle = psi.norm();
    let (_, beta) = log_coefficients(angle, 1.0 / (0.5 * angle).tan());
    let turn = psi.cross(&x);
    let linear = -(k_omega + k_v) * x - k_v * (0.5 * turn + beta * psi.cross(&turn));
    let angular = -k_omega * psi;
    Vector6::new(angular.x, angular.y, angular.z, linear.x, linear.y, linear.z)
}

impl TaskSpaceLogc {
    /// Simulates the paper's motion with the constants of the experiment.
    ///
    /// # Errors
    /// [`PaperError`] if the simulation fails.
    pub fn new(lab: &Laboratory) -> Result<Self, PaperError> {
        let constants = &lab.experiment.task_space_logc;
        let gains = [constants.gain_angular, constants.gain_linear];
        let start = lab.chain.forward_kinematics(&lab.experiment.theta_initial)?;
        let goal = nearer_goal(&lab.goal()?, &start);
        let initial = (goal.inverse() * start).half_log();
        let rate = |x: &[f64], change: &mut [f64]| {
            change.copy_from_slice(half_log_rate(gains, &Vector6::from_column_slice(x)).as_slice());
        };
        let trajectory = integrate(rate, initial.as_slice(), constants.duration)?;
        let half_logs: Vec<_> =
            trajectory.states.iter().map(|state| Vector6::from_column_slice(state)).collect();
        let poses = half_logs.iter().map(|half_log| goal * UnitDualQuaternion::half_exp(half_log)).collect();
        Ok(Self { times: trajectory.times, half_logs, poses, goal })
    }

    /// Computes the metrics of the motion.
    pub fn metrics(&self) -> TaskSpaceMetrics {
        let points = || self.poses.iter().map(UnitDualQuaternion::translation);
        let length: f64 = points().zip(points().skip(1)).map(|(a, b)| (b - a).norm()).sum();
        let straight = points().next().map_or(0.0, |start| (start - self.goal.translation()).norm());
        TaskSpaceMetrics {
            initial: self.half_logs.first().map_or([0.0; 6], |half_log| (*half_log).into()),
            last_crossing_s: std::array::from_fn(|component| self.last_crossing(component)),
            settling_time_rotation: self.settled(0),
            settling_time_position: self.settled(3),
            path_ratio: length / straight,
        }
    }

    /// Returns the time from which a component stays within 1e-3 of zero \[s\]; `None` if there is no such time. In figure 4 of the
    /// paper, the component's curve begins at this time.
    fn last_crossing(&self, component: usize) -> Option<f64> {
        const EDGE: f64 = 1e-3;
        let size = |sample: usize| Some(self.half_logs.get(sample)?[component].abs());
        let last = self.half_logs.iter().rposition(|half_log| half_log[component].abs() > EDGE)?;
        let (before, after) = (size(last)?, size(last + 1)?);
        let part = (before - EDGE) / (before - after);
        Some(self.times[last] + part * (self.times[last + 1] - self.times[last]))
    }

    /// Returns the time from which a norm stays below 2 % of its initial value \[s\]; `None` if there is no such time. It is the norm
    /// of the components `first` to `first + 2` of the half-log pair: 0 for the rotation, 3 for the translation.
    fn settled(&self, first: usize) -> Option<f64> {
        let size = |half_log: &Vector6<f64>| half_log.fixed_rows::<3>(first).norm();
        let mut settling = Settling::new(self.half_logs.first().map_or(0.0, size), 0.0);
        for (time, half_log) in self.times.iter().zip(&self.half_logs) {
            settling.update(Duration::from_secs_f64(*time), size(half_log));
        }
        settling.time().map(|time| time.as_secs_f64())
    }
}
