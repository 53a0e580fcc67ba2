//! The straight line in joint space to another configuration or to a joint goal, and the speed along it.

use crate::servo::{Arms, Limits};
use dq_algebra::UnitDualQuaternion;
use dq_kinematics::arm::JointKind;
use dq_limits::Braking;
use dq_metrics::Tolerance;

/// Number of equal parts into which the braking distance is divided. The tool's speed is checked at the ends of each part.
const PLACES: u32 = 32;

/// The fraction of the acceleration limit that the arm uses to brake for the tool's speed limits.
const SHARE: f64 = 0.5;

/// The straight line in joint space to a joint goal, or to the configuration that a search has found.
pub(super) struct JointLine {
    /// The end of the line \[rad, prismatic: m\], one number per joint.
    pub positions: Vec<f64>,
    /// A joint goal that is not accepted yet \[rad, prismatic: m\].
    pub offered: Vec<f64>,
    pub kinds: Vec<JointKind>,
    /// The arms at the point of the line that is being evaluated.
    trial: Arms,
    /// The joint positions at the point of the line that is being evaluated \[rad, prismatic: m\].
    place: Vec<f64>,
    /// The remaining displacement of each joint to the end of the line \[rad, prismatic: m\].
    rest: Vec<f64>,
}

impl JointLine {
    /// Creates a line whose end is not set yet. The line computes the kinematics along it with `trial`.
    pub fn new(trial: Arms) -> Self {
        let kinds = trial.joint_kinds();
        let zeros = vec![0.0; kinds.len()];
        let offered = zeros.clone();
        Self { positions: zeros.clone(), offered, kinds, trial, place: zeros.clone(), rest: zeros }
    }

    /// Sets the tool offset.
    pub fn set_tool_offset(&mut self, tool_offset: &UnitDualQuaternion) {
        self.trial.set_tool_offset(tool_offset);
    }

    /// Returns the controlled pose at the offered joint goal.
    pub fn offered_pose(&mut self) -> UnitDualQuaternion {
        self.trial.evaluate(&self.offered);
        self.trial.pose()
    }

    /// Accepts the offered joint goal: it becomes the end of the line.
    pub fn accept(&mut self) {
        self.positions.copy_from_slice(&self.offered);
    }

    /// Returns the controlled pose at the end of the line.
    pub fn end_pose(&mut self) -> UnitDualQuaternion {
        self.trial.evaluate(&self.positions);
        self.trial.pose()
    }

    /// Returns whether each joint at `from` is within `tolerance` of the end of the line: a revolute joint within its angle, a
    /// prismatic joint within its length.
    pub fn is_near(&self, from: &[f64], limits: &Limits, tolerance: &Tolerance) -> bool {
        let mut joints = self.displacements(from, limits).zip(&self.kinds);
        joints.all(|(displacement, kind)| match kind {
            JointKind::Revolute => displacement.abs() <= tolerance.angular,
            JointKind::Prismatic => displacement.abs() <= tolerance.linear,
        })
    }

    /// Returns the displacement of each joint from `from` to the end of the line \[rad, prismatic: m\]. A revolute joint without
    /// position limits turns in the shorter direction, because its encoder may wrap from one end of the range to the other.
    pub fn displacements<'a>(
        &'a self,
        from: &'a [f64],
        limits: &'a Limits,
    ) -> impl Iterator<Item = f64> + 'a {
        let joints = self.positions.iter().zip(from).zip(limits.position.ranges()).zip(&self.kinds);
        joints.map(|(((to, from), range), kind)| match range {
            (f64::NEG_INFINITY, f64::INFINITY) => kind.displacement(*from, *to),
            _ => to - from,
        })
    }

    /// Returns the joint (counted from 0) that takes the longest time from `from` to the end of the line at its largest speed. Also
    /// returns this time \[s\].
    pub fn longest(&self, from: &[f64], limits: &Limits) -> (usize, f64) {
        let times = self
            .displacements(from, limits)
            .zip(&limits.joint_velocity)
            .map(|(displacement, speed)| displacement.abs() / speed);
        times.enumerate().max_by(|(_, a), (_, b)| a.total_cmp(b)).unwrap_or_default()
    }

    /// Computes the joint velocities [rad/s, prismatic: m/s] along the line from `from`. All joints reach the end together, as
    /// early as the slowest joint can. They slow down before the end as before a position limit.
    pub fn velocity(&mut self, from: &[f64], limits: &Limits, braking: &Braking, velocity: &mut [f64]) {
        let mut rest = std::mem::take(&mut self.rest);
        rest.iter_mut()
            .zip(self.displacements(from, limits))
            .for_each(|(rest, displacement)| *rest = displacement);
        let (mut rate, mut acceleration) = (f64::INFINITY, f64::INFINITY);
        for (joint, rest) in rest.iter().enumerate().filter(|(_, rest)| **rest != 0.0) {
            let approach = limits.approach(joint, braking);
            rate = rate.min(approach.speed(rest.abs()) / rest.abs());
            acceleration = acceleration.min(SHARE * approach.deceleration / rest.abs());
        }
        // If no displacement is left, the rate is infinite.
        let rate =
            if rate.is_finite() { self.tool_rate(from, &rest, limits, rate, acceleration) } else { 0.0 };
        velocity.iter_mut().zip(&rest).for_each(|(speed, rest)| *speed = rate * rest);
        self.rest = rest;
    }

    /// Returns the rate at which to move: the fraction of the displacements `rest` per second [1/s], at most `rate`.
    ///
    /// The tool must keep its speed limits along the rest of the line. The limits at the present position are not enough: if joints
    /// turn in opposite directions, the tool may hardly move now and move fast a little later. So the arm must be able to slow down
    /// in time, by `acceleration` a [1/s²]. Let `r(p)` be the rate that the limits allow after the fraction p of the displacements.
    /// The present rate may then be at most `√(r(p)² + 2 a p)`, for every p.
    fn tool_rate(
        &mut self,
        from: &[f64],
        rest: &[f64],
        limits: &Limits,
        rate: f64,
        acceleration: f64,
    ) -> f64 {
        let braking = (rate * rate / (2.0 * acceleration)).min(1.0);
        let mut allowed = rate;
        for number in 0..=PLACES {
            let part = braking * f64::from(number) / f64::from(PLACES);
            let joints = self.place.iter_mut().zip(from).zip(rest);
            joints.for_each(|((place, from), rest)| *place = from + part * rest);
            self.trial.evaluate(&self.place);
            let tool = self.trial.tool_speed(rest);
            let there = (limits.linear_speed / tool.linear).min(limits.angular_speed / tool.angular);
            allowed = allowed.min((there * there + 2.0 * acceleration * part).sqrt());
        }
        allowed
    }
}
