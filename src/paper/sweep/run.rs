//! One closed loop of the sweep: a law and an arm without limits, in continuous time.
//!
//! Fast because the method takes few evaluations of the law, and because nothing else is evaluated: between the ends of a step, whose
//! poses and twists are known, the tool is on a cubic.

use super::Outcome;
use super::chebyshev::Chebyshev;
use super::dormand_prince::DormandPrince;
use super::solution::{Flow, Method, Solution, speed_between};
use crate::arm::{ArmError, ArmState};
use crate::control::{Controller, pose_error};
use crate::dq::UnitDualQuaternion;
use crate::paper::Laboratory;
use crate::servo::{GoalError, Motion};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use std::time::Duration;

/// Times at which a part of the error enters or leaves its 2 % band are right to this \[s\].
pub const INTERVAL: f64 = 2.5e-3;

/// Between two samples there is no more time \[s\], up to so many in a step: enough for path and peaks.
const SPACING: f64 = 2e-2;
const MOST_PARTS: f64 = 16.0;

/// A tenth of the 2 % band: from there no law has turned back.
const ARRIVED: f64 = 2e-3;

/// A law that decays faster than this [1/s] is a transposed Jacobian; the others decay at their gain.
const FAST: f64 = 20.0;

/// What needs more steps than this is going round in circles.
const MOST_STEPS: usize = 20_000;

/// An arm under a law.
struct Loop<'a> {
    lab: &'a Laboratory,
    controller: &'a Controller,
    goal: &'a UnitDualQuaternion,
    arm: ArmState,
}

impl Flow for Loop<'_> {
    fn velocity(&mut self, theta: &[f64], theta_dot: &mut [f64]) {
        // The count of the joints was checked with the start.
        if self.lab.chain.evaluate(theta, &mut self.arm).is_ok() {
            self.controller.joint_velocity(&self.arm, self.goal, theta_dot);
        }
    }

    fn fastest_rate(&self) -> f64 {
        self.controller.fastest_rate(&self.arm, self.goal)
    }
}

/// The tool at a time: where it is, and how it moves along the base's axes.
#[derive(Clone, Copy)]
struct Tool {
    time: f64,
    rotation: Quaternion<f64>,
    point: Vector3<f64>,
    /// `½ ω r`.
    turning: Quaternion<f64>,
    speed: Vector3<f64>,
}

impl Loop<'_> {
    /// The tool at `time` with the arm where it was last evaluated.
    fn tool(&self, time: f64, theta_dot: &[f64]) -> Tool {
        let (angular, speed) = self.arm.tool_twist(theta_dot);
        let rotation = self.arm.base_from_tool().real();
        let turning = Quaternion::from_imag(0.5 * angular) * rotation;
        Tool { time, rotation, point: self.arm.tool_point(), turning, speed }
    }

    fn error(&self) -> GoalError {
        let error = pose_error(&self.arm, self.goal);
        GoalError { position: error.translation().norm(), rotation: error.rotation().angle() }
    }
}

impl Tool {
    /// The tool at the part `part` of the way in time from `self` to `to`, on the cubic of both poses and twists: where, and turned how.
    fn between(&self, to: &Self, part: f64) -> (Vector3<f64>, UnitQuaternion<f64>) {
        let (rest, step) = (1.0 - part, to.time - self.time);
        let (a, b) = (rest * rest * (1.0 + 2.0 * part), part * part * (1.0 + 2.0 * rest));
        let (c, d) = (step * part * rest * rest, -step * part * part * rest);
        let rotation = self.rotation * a + to.rotation * b + self.turning * c + to.turning * d;
        let point = a * self.point + b * to.point + c * self.speed + d * to.speed;
        (point, UnitQuaternion::new_normalize(rotation))
    }
}

/// Runs the loop from `start` \[rad\] for the sweep's time, or until it has arrived. A loop that cannot be integrated has failed its task.
///
/// # Errors
/// [`ArmError::JointCount`].
pub(super) fn run(
    lab: &Laboratory,
    controller: &Controller,
    goal: &UnitDualQuaternion,
    start: &[f64],
) -> Result<Outcome, ArmError> {
    let mut arm = ArmState::new(&lab.chain);
    lab.chain.evaluate(start, &mut arm)?;
    let flow = Loop { lab, controller, goal, arm };
    Ok(match flow.fastest_rate() < FAST {
        true => follow::<DormandPrince>(flow, start),
        false => follow::<Chebyshev>(flow, start),
    })
}

/// Follows the loop from `start` by one of the methods, as [`run`].
fn follow<M: Method>(flow: Loop, start: &[f64]) -> Outcome {
    let Loop { lab, goal, .. } = flow;
    let mut solution = Solution::<_, M>::new(flow, start, M::TOLERANCE);
    let (mut tool, mut error) = (solution.flow.tool(0.0, &solution.now.velocity), solution.flow.error());
    let (distance, angle) = (error.position, error.rotation);
    let mut motion =
        Motion::begin(Duration::ZERO, tool.point, goal.translation(), &error, &lab.settings.goal_tolerance);
    motion.update(Duration::ZERO, tool.point, &error, &solution.now.velocity);
    let mut theta_dot = solution.now.velocity.clone();
    for _ in 0..MOST_STEPS {
        if !solution.advance(lab.experiment.sweep.duration) {
            return Outcome::default();
        }
        let (before, error_before) = (tool, error);
        (tool, error) = (solution.flow.tool(solution.time, &solution.now.velocity), solution.flow.error());
        let step = tool.time - before.time;
        let parts = match motion.crosses(&error_before, &error) {
            true => step / INTERVAL,
            false => (step / SPACING).min(MOST_PARTS),
        };
        let parts = parts.ceil().max(M::SAMPLES) as u32;
        for number in 1..parts {
            let part = f64::from(number) / f64::from(parts);
            let (point, rotation) = before.between(&tool, part);
            let position = (point - goal.translation()).norm();
            let error = GoalError { position, rotation: rotation.angle_to(&goal.rotation()) };
            let ends = (&solution.before, &solution.now);
            theta_dot.iter_mut().enumerate().for_each(|(i, slot)| *slot = speed_between(ends, step, part, i));
            let time = before.time + part * step;
            motion.update(Duration::from_secs_f64(time), point, &error, &theta_dot);
        }
        motion.update(Duration::from_secs_f64(tool.time), tool.point, &error, &solution.now.velocity);
        let arrived = error.position < ARRIVED * distance && error.rotation < ARRIVED * angle;
        if arrived || solution.time >= lab.experiment.sweep.duration {
            let figures = motion.figures();
            return Outcome {
                settling_time: figures.settling_time(),
                path_ratio: figures.path_length / distance,
                peak_joint_speed: figures.peak_joint_speed,
            };
        }
    }
    Outcome::default()
}
