//! One closed loop of the sweep: a law and an arm without limits, in continuous time.
//!
//! Fast because the method takes few evaluations of the law, and because nothing else is evaluated: between the ends of a step, whose
//! poses and twists are known, the tool is on a cubic.

use super::Outcome;
use super::chebyshev::Chebyshev;
use super::dormand_prince::DormandPrince;
use super::solution::{Flow, Method, Point, Solution, speed_between};
use crate::arm::{ArmError, ArmState};
use crate::control::Controller;
use crate::dq::UnitDualQuaternion;
use crate::paper::Laboratory;
use crate::servo::{GoalError, MotionMeter};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use std::time::Duration;

/// Times at which a part of the error enters or leaves its 2 % band are right to this \[s\].
pub const INTERVAL: f64 = 2.5e-3;

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
        self.controller.fastest_rates(&self.arm, self.goal).into_iter().fold(0.0, f64::max)
    }
}

/// The tool at the end of a step: where it is, and how it moves along the base's axes.
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
}

/// Where the goal is.
struct Place {
    rotation: UnitQuaternion<f64>,
    point: Vector3<f64>,
}

impl Place {
    /// The tool at a part of a step's time, with its pose there.
    fn sample(&self, part: f64, rotation: Quaternion<f64>, point: Vector3<f64>) -> Sample {
        let rotation = UnitQuaternion::new_normalize(rotation).angle_to(&self.rotation);
        Sample { part, point, error: GoalError { position: (point - self.point).norm(), rotation } }
    }
}

/// The tool at a part of a step's time.
#[derive(Clone, Copy)]
struct Sample {
    part: f64,
    point: Vector3<f64>,
    error: GoalError,
}

/// A step from one end to the other.
struct Step<'a> {
    tools: [Tool; 2],
    joints: [&'a Point; 2],
    goal: &'a Place,
}

impl Step<'_> {
    /// How long it takes \[s\].
    fn duration(&self) -> f64 {
        self.tools[1].time - self.tools[0].time
    }

    /// The tool at that part of the step, on the cubic of both poses and twists.
    fn sample(&self, part: f64) -> Sample {
        let ([from, to], duration) = (&self.tools, self.duration());
        let rest = 1.0 - part;
        let (a, b) = (rest * rest * (1.0 + 2.0 * part), part * part * (1.0 + 2.0 * rest));
        let (c, d) = (duration * part * rest * rest, -duration * part * part * rest);
        let rotation = from.rotation * a + to.rotation * b + from.turning * c + to.turning * d;
        let point = a * from.point + b * to.point + c * from.speed + d * to.speed;
        self.goal.sample(part, rotation, point)
    }

    /// Adds the sample `to`, which comes after `from`, and before it others where a part of the error enters or leaves its band between
    /// them: halfway, until that is known to [`INTERVAL`].
    fn measure(&self, motion: &mut MotionMeter, from: &Sample, to: &Sample, theta_dot: &mut [f64]) {
        if (to.part - from.part) * self.duration() > INTERVAL && motion.crosses(&from.error, &to.error) {
            let middle = self.sample(0.5 * (from.part + to.part));
            self.measure(motion, from, &middle, theta_dot);
            return self.measure(motion, &middle, to, theta_dot);
        }
        for (i, slot) in theta_dot.iter_mut().enumerate() {
            *slot = speed_between(self.joints, self.duration(), to.part, i);
        }
        let time = self.tools[0].time + to.part * self.duration();
        motion.update(Duration::from_secs_f64(time), to.point, &to.error, theta_dot);
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
    let goal = Place { rotation: goal.rotation(), point: goal.translation() };
    let mut solution = Solution::<_, M>::new(flow, start, M::TOLERANCE);
    let mut theta_dot = solution.now.velocity.clone();
    let mut tool = solution.flow.tool(0.0, &theta_dot);
    let begin = goal.sample(0.0, tool.rotation, tool.point);
    let GoalError { position: distance, rotation: angle } = begin.error;
    let tolerance = &lab.settings.goal_tolerance;
    let mut motion = MotionMeter::begin(Duration::ZERO, tool.point, goal.point, &begin.error, tolerance)
        .of_continuous_velocities();
    motion.update(Duration::ZERO, tool.point, &begin.error, &theta_dot);
    let mut last = begin;
    for _ in 0..MOST_STEPS {
        if !solution.advance(lab.experiment.sweep.duration) {
            return Outcome::default();
        }
        let before = std::mem::replace(&mut tool, solution.flow.tool(solution.time, &solution.now.velocity));
        let step = Step { tools: [before, tool], joints: [&solution.before, &solution.now], goal: &goal };
        let inside = (1..M::PARTS).map(|number| step.sample(f64::from(number) / f64::from(M::PARTS)));
        let samples = inside.chain([goal.sample(1.0, tool.rotation, tool.point)]);
        last = samples.fold(Sample { part: 0.0, ..last }, |from, to| {
            step.measure(&mut motion, &from, &to, &mut theta_dot);
            to
        });
        let arrived = last.error.position < ARRIVED * distance && last.error.rotation < ARRIVED * angle;
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
