//! The straight line in joint space to another configuration, and how fast the arm goes along it.

use crate::servo::{Arms, Limits};
use dq_algebra::UnitDualQuaternion;
use dq_kinematics::arm::JointKind;
use dq_limits::Braking;

/// So many places ahead, as far as braking takes, are looked at for how fast the tool may be there.
const PLACES: u32 = 32;

/// The part of the acceleration that braking for the tool counts on.
const SHARE: f64 = 0.5;

/// Where the joints go, as long as a reconfiguration is found or in progress.
pub(super) struct Elsewhere {
    /// The end of the line \[rad, prismatic: m\], one number a joint.
    pub positions: Vec<f64>,
    pub kinds: Vec<JointKind>,
    /// To try places on the line, and such a place.
    trial: Arms,
    place: Vec<f64>,
    /// How far each joint has to go.
    rest: Vec<f64>,
}

impl Elsewhere {
    /// Nowhere yet, for the arms of `trial`.
    pub fn new(trial: Arms) -> Self {
        let kinds = trial.joint_kinds();
        let zeros = vec![0.0; kinds.len()];
        Self { positions: zeros.clone(), kinds, trial, place: zeros.clone(), rest: zeros }
    }

    /// Puts the tool that is tried at `tool_offset`.
    pub fn set_tool_offset(&mut self, tool_offset: &UnitDualQuaternion) {
        self.trial.set_tool_offset(tool_offset);
    }

    /// How far each joint at `from` has to go \[rad, prismatic: m\]: one that turns without end in the shorter direction, as its encoder may
    /// wrap between.
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

    /// The joint, counted from 0, that takes longest at its largest speed from where they are at `from`, and how long \[s\].
    pub fn longest(&self, from: &[f64], limits: &Limits) -> (usize, f64) {
        let times = self
            .displacements(from, limits)
            .zip(&limits.joint_velocity)
            .map(|(displacement, speed)| displacement.abs() / speed);
        times.enumerate().max_by(|(_, a), (_, b)| a.total_cmp(b)).unwrap_or_default()
    }

    /// The joint velocities [rad/s, prismatic: m/s] along the line from where the joints are at `from`: all are at the same part of their
    /// displacements, as fast as the slowest allows, and slow down for the end as for a position limit.
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
        // Where no joint has to go anywhere, none has a rate.
        let rate =
            if rate.is_finite() { self.tool_rate(from, &rest, limits, rate, acceleration) } else { 0.0 };
        velocity.iter_mut().zip(&rest).for_each(|(speed, rest)| *speed = rate * rest);
        self.rest = rest;
    }

    /// The part of the `rest` that is gone in a second, at most `rate` [1/s], so that the tool keeps its speed limits along it
    /// with this `acceleration` [1/s²]: at the part p of the path the rate r may be `√(r(p)² + 2 a p)`, where `r(p)` is what the tool's limits
    /// allow there. Where the tool hardly moves while the joints do, as they go in opposite directions, it may move much a little later.
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
