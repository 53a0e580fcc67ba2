//! The envelope: for each joint the speeds that its next command may have.
//!
//! They are those from which a stop still keeps the limits on speed, acceleration, jerk and position, with the delay of the robot and the
//! cycles that come late in it ([`Span`]). The next speed of a stop is one of them whatever the limits are, so that there always is one.

mod latched_limits;
mod span;
#[cfg(test)]
mod tests;

pub(in crate::servo) use latched_limits::LatchedLimits;
pub(super) use span::Span;

use super::{Given, keep_speed_limits, tool_share};
use crate::servo::limits::STOP_TIME;
use crate::servo::{PositionLimits, Violation};

/// What the joints may do in this cycle.
pub(super) struct Envelope {
    spans: Vec<Span>,
    /// The speeds at which joints go on whose accelerations come to nothing [rad/s].
    rest: Vec<f64>,
    /// The first joint, counted from 0, that its position limit holds back.
    pub held_back: Option<usize>,
}

impl Envelope {
    /// For so many joints.
    pub fn new(joints: usize) -> Self {
        Self { spans: vec![Span::default(); joints], rest: vec![0.0; joints], held_back: None }
    }

    /// Takes what holds in this cycle.
    pub fn enclose(&mut self, given: &Given) {
        self.spans.iter_mut().enumerate().for_each(|(joint, span)| *span = given.span(joint));
    }

    /// Makes of the `velocity` that is wanted the next command [rad/s, prismatic: m/s], one number a joint.
    pub fn admit(&mut self, given: &Given, velocity: &mut [f64]) {
        self.keep_range(&given.settings.limits.position, given.positions, velocity);
        // The joint that was slowed may have been what kept the tool slow.
        keep_speed_limits(given, velocity);
        self.go_towards(velocity, given.period);
        self.slow_tool(given, velocity);
    }

    /// What of a command does not lie in the envelope, if anything.
    pub fn violation(&self, command: &[f64]) -> Option<Violation> {
        let mut joints = command.iter().zip(&self.spans).enumerate();
        joints.find_map(|(joint, (speed, span))| span.violation(joint, *speed))
    }

    /// Cuts what goes too fast for a joint, which holds up no other one by that.
    fn keep_range(&mut self, limits: &PositionLimits, positions: &[f64], velocity: &mut [f64]) {
        self.held_back = None;
        for (joint, (speed, span)) in velocity.iter_mut().zip(&self.spans).enumerate() {
            let kept = span.within_position_limits(*speed);
            if kept != *speed && limits.is_near(joint, positions[joint]) {
                self.held_back.get_or_insert(joint);
            }
            *speed = kept;
        }
    }

    /// Goes along the line from the last command to `velocity` as far as each joint can in a cycle, so that a switch neither steps the
    /// command nor turns it.
    ///
    /// Where all of the line would take longer than a stop, because one joint may hardly accelerate, the joints that are to slow down do so
    /// by themselves: a weak joint holds up no other one's braking.
    fn go_towards(&self, velocity: &mut [f64], period: f64) {
        let parts = velocity.iter().zip(&self.spans).map(|(wanted, span)| span.part_of_way(*wanted));
        let part = parts.fold(1.0, f64::min);
        for (speed, span) in velocity.iter_mut().zip(&self.spans) {
            let slower = span.slower_than_last(*speed).filter(|_| part * STOP_TIME < period);
            *speed = slower.map_or(span.along(*speed, part), |slower| span.towards(slower));
        }
    }

    /// Slows the joints to the tool's speed limits, each as far as it can be slowed: limits may have been lowered, and what was changed for
    /// one joint alone may have made the tool faster. What counts is how fast the tool is when accelerations have come to nothing.
    fn slow_tool(&mut self, given: &Given, velocity: &mut [f64]) {
        let joints = self.rest.iter_mut().zip(&*velocity).zip(&self.spans);
        joints.for_each(|((rest, speed), span)| *rest = span.rest(*speed));
        let factor = tool_share(&given.settings.limits, &given.arms.tool_speed(&self.rest));
        if factor < 1.0 {
            let joints = velocity.iter_mut().zip(&self.rest).zip(&self.spans);
            joints.for_each(|((speed, rest), span)| *speed = span.towards(factor * rest));
        }
    }
}
