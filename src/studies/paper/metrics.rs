//! The metrics of a simulated motion.

use super::{Laboratory, PaperError, SimulatedRun};
use dq_kinematics::arm::ArmState;
use dq_metrics::{Figures, GoalError, MotionMeter, Settling};
use serde::Serialize;
use std::time::Duration;

/// The metrics of a simulated motion.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Metrics {
    /// The metrics that [`MotionMeter`] computes.
    #[serde(flatten)]
    pub figures: Figures,
    /// The time from which each joint stays within 2 % of its position at the goal \[s\]. `None` if the joint does not stay there,
    /// or if its position at the goal is 0.
    pub settling_time_2_percent_joints_s: Vec<Option<f64>>,
    /// The distance from start to goal \[m\].
    pub distance_m: f64,
    /// Whether the determinant of the Jacobian of six joints changed its sign during the motion. If so, the smallest singular value
    /// in `figures` is set to 0. The samples alone do not show this value, because no sample is exactly at the singularity.
    pub singularity_crossed: bool,
    /// The times at which the determinant changed its sign \[s\]: for each change, the time of the first sample after it.
    pub singularities_crossed_s: Vec<f64>,
    /// The final error of each joint as a percentage of its position at the goal; `None` if its position at the goal is 0.
    pub joint_error_percent: Vec<Option<f64>>,
}

impl Laboratory {
    /// Computes the metrics of a run.
    ///
    /// # Errors
    /// [`PaperError::Arm`] if the run belongs to another arm.
    pub fn metrics(&self, run: &SimulatedRun) -> Result<Metrics, PaperError> {
        let SimulatedRun { controller, goal, trajectory, poses } = run;
        let mut state = ArmState::new(&self.chain);
        let mut theta_dot = vec![0.0; self.chain.joint_count()];
        let mut motion: Option<MotionMeter> = None;
        let (mut singularities_crossed_s, mut last) = (Vec::new(), None);
        for ((time, theta), pose) in trajectory.times.iter().zip(&trajectory.states).zip(poses) {
            self.chain.evaluate(theta, &mut state)?;
            controller.joint_velocity(&state, goal, &mut theta_dot);
            let (now, point) = (Duration::from_secs_f64(*time), pose.translation());
            let error = GoalError::of(controller.aim, &state, goal);
            let begin = || {
                let tolerance = &self.settings.goal_tolerance;
                MotionMeter::begin(now, point, goal.translation(), &error, tolerance)
                    .of_continuous_velocities()
            };
            let motion = motion.get_or_insert_with(begin);
            motion.update(now, point, &error, &theta_dot);
            motion.see_singular_value(controller.smallest_singular_value(&state));
            let side = determinant(&state).map(f64::signum);
            if last.zip(side).is_some_and(|(before, now): (f64, f64)| before != now) {
                singularities_crossed_s.push(*time);
            }
            last = side;
        }
        let singularity_crossed = !singularities_crossed_s.is_empty();
        let mut figures = motion.map(|motion| motion.figures()).unwrap_or_default();
        if singularity_crossed {
            figures.smallest_singular_value = Some(0.0);
        }
        Ok(Metrics {
            figures,
            settling_time_2_percent_joints_s: self.joints_settled(run),
            distance_m: poses.first().map_or(0.0, |start| (start.translation() - goal.translation()).norm()),
            singularity_crossed,
            singularities_crossed_s,
            joint_error_percent: self.joint_error_percent(run),
        })
    }

    fn joints_settled(&self, run: &SimulatedRun) -> Vec<Option<f64>> {
        let settled = |(joint, wanted): (usize, &f64)| {
            if *wanted == 0.0 {
                return None;
            }
            let mut settling = Settling::new(*wanted, 0.0);
            for (time, theta) in run.trajectory.times.iter().zip(&run.trajectory.states) {
                settling.update(Duration::from_secs_f64(*time), (theta[joint] - wanted).abs());
            }
            settling.time().map(|time| time.as_secs_f64())
        };
        self.experiment.theta_desired.iter().enumerate().map(settled).collect()
    }

    fn joint_error_percent(&self, run: &SimulatedRun) -> Vec<Option<f64>> {
        let end = run.trajectory.states.last().map_or(&[][..], Vec::as_slice);
        let percent = |(angle, wanted): (&f64, &f64)| {
            (*wanted != 0.0).then(|| 100.0 * ((angle - wanted) / wanted).abs())
        };
        end.iter().zip(&self.experiment.theta_desired).map(percent).collect()
    }
}

/// Returns the determinant of the body Jacobian; `None` unless the arm has six joints.
fn determinant(state: &ArmState) -> Option<f64> {
    let jacobian = state.body_jacobian();
    (jacobian.ncols() == 6).then(|| jacobian.fixed_columns::<6>(0).determinant())
}
