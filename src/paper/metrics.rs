//! The figures of a simulated motion.

use super::{PaperError, Trajectory};
use crate::arm::{ArmState, Chain};
use crate::control::Controller;
use crate::dq::UnitDualQuaternion;
use crate::servo::{Figures, MotionMeter, OneArm, Settling, Task, Tolerance};
use nalgebra::Vector3;
use serde::Serialize;
use std::time::Duration;

/// A simulated motion in numbers.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Metrics {
    /// What it was like, by the project's one definition of each figure.
    #[serde(flatten)]
    pub figures: Figures,
    /// When each joint had come within 2 % of its angle at the goal for good; none where it has not, or where that angle is 0.
    pub settling_time_2_percent_joints_s: Vec<Option<f64>>,
    /// Distance from start to goal.
    pub distance_m: f64,
    /// The smallest singular value of the Jacobian on the way; 0 where a singularity is crossed.
    pub smallest_singular_value: f64,
    /// Whether the determinant of the Jacobian of six joints changed its sign on the way.
    pub singularity_crossed: bool,
    /// How far each joint is from its angle at the goal in the end, in percent of that angle; none where that is 0.
    pub joint_error_percent: Vec<Option<f64>>,
}

/// A motion to measure.
pub struct Measured<'a> {
    /// The arm that moved.
    pub chain: &'a Chain,
    /// The law that drove it.
    pub controller: &'a Controller,
    /// The goal, with the sign that the law was given.
    pub goal: &'a UnitDualQuaternion,
    /// The joint angles at the goal \[rad\].
    pub theta_goal: &'a [f64],
    /// The joint angles over time.
    pub trajectory: &'a Trajectory,
}

impl Measured<'_> {
    /// The motion's figures, by the project's one definition of each ([`MotionMeter`]).
    ///
    /// # Errors
    /// [`PaperError::Arm`] where the trajectory is not this arm's.
    pub fn figures(&self, tolerance: &Tolerance) -> Result<Figures, PaperError> {
        let mut arm = OneArm::new(self.chain.clone());
        let mut theta_dot = vec![0.0; self.chain.joint_count()];
        let mut motion: Option<MotionMeter> = None;
        for (time, theta) in self.trajectory.times.iter().zip(&self.trajectory.states) {
            arm.evaluate(theta)?;
            arm.joint_velocity(self.controller, self.goal, &mut theta_dot);
            let (now, point) = (Duration::from_secs_f64(*time), arm.pose().translation());
            let error = arm.goal_error(self.controller, self.goal);
            let begin = || {
                MotionMeter::begin(now, point, self.goal.translation(), &error, tolerance)
                    .of_continuous_velocities()
            };
            motion.get_or_insert_with(begin).update(now, point, &error, &theta_dot);
        }
        Ok(motion.map(|motion| motion.figures()).unwrap_or_default())
    }

    /// The motion's figures and what concerns the joints.
    ///
    /// # Errors
    /// [`PaperError::Arm`] where the trajectory is not this arm's.
    pub fn metrics(&self, tolerance: &Tolerance) -> Result<Metrics, PaperError> {
        let figures = self.figures(tolerance)?;
        let (smallest_singular_value, singularity_crossed) = self.singularity()?;
        let distance_m = (self.start_point()? - self.goal.translation()).norm();
        Ok(Metrics {
            settling_time_2_percent_joints_s: self.joints_settled(),
            distance_m,
            figures,
            smallest_singular_value,
            singularity_crossed,
            joint_error_percent: self.joint_error_percent(),
        })
    }

    fn joints_settled(&self) -> Vec<Option<f64>> {
        let settled = |(joint, wanted): (usize, &f64)| {
            if *wanted == 0.0 {
                return None;
            }
            let mut settling = Settling::new(*wanted, 0.0);
            for (time, theta) in self.trajectory.times.iter().zip(&self.trajectory.states) {
                settling.update(Duration::from_secs_f64(*time), (theta[joint] - wanted).abs());
            }
            settling.time().map(|time| time.as_secs_f64())
        };
        self.theta_goal.iter().enumerate().map(settled).collect()
    }

    /// The smallest singular value, and whether a singularity was crossed: there it is 0, and what the samples have is but how near to
    /// it one of them happened to be.
    fn singularity(&self) -> Result<(f64, bool), PaperError> {
        let mut state = ArmState::new(self.chain);
        let (mut smallest, mut crossed, mut last) = (f64::INFINITY, false, None);
        for theta in &self.trajectory.states {
            self.chain.evaluate(theta, &mut state)?;
            smallest = smallest.min(state.smallest_singular_value());
            let determinant = determinant(&state);
            crossed |= last.zip(determinant).is_some_and(|(a, b): (f64, f64)| a.signum() != b.signum());
            last = determinant;
        }
        Ok((if crossed { 0.0 } else { smallest }, crossed))
    }

    fn joint_error_percent(&self) -> Vec<Option<f64>> {
        let end = self.trajectory.states.last().map_or(&[][..], Vec::as_slice);
        let percent = |(angle, wanted): (&f64, &f64)| {
            (*wanted != 0.0).then(|| 100.0 * ((angle - wanted) / wanted).abs())
        };
        end.iter().zip(self.theta_goal).map(percent).collect()
    }

    fn start_point(&self) -> Result<Vector3<f64>, PaperError> {
        let start = self.trajectory.states.first().map_or(&[][..], Vec::as_slice);
        Ok(self.chain.forward_kinematics(start)?.translation())
    }
}

/// The determinant of the body Jacobian, if it is square.
fn determinant(state: &ArmState) -> Option<f64> {
    let jacobian = state.body_jacobian();
    (jacobian.ncols() == 6).then(|| jacobian.fixed_columns::<6>(0).determinant())
}

/// The tool poses along a trajectory.
///
/// # Errors
/// [`PaperError::Arm`] where the trajectory is not this arm's.
pub fn tool_poses(chain: &Chain, trajectory: &Trajectory) -> Result<Vec<UnitDualQuaternion>, PaperError> {
    let mut state = ArmState::new(chain);
    let pose = |theta: &Vec<f64>| {
        chain.evaluate(theta, &mut state)?;
        Ok(state.base_from_tool())
    };
    trajectory.states.iter().map(pose).collect()
}
