//! The envelope: for each joint the speeds that its next command may have.
//!
//! They are those from which a stop still keeps the limits on speed, acceleration, jerk and position, with the delay of the robot and the
//! cycles that come late in it ([`Span`]). The next speed of a stop is one of them whatever the limits are, so that there always is one.

use crate::{Joints, Limits, STOP_TIME, Span, Violation, scale};
use dq_kinematics::arm::Arms;

/// What the joints may do in this cycle.
#[derive(Debug)]
pub struct Envelope {
    spans: Vec<Span>,
    /// The speeds at which joints go on whose accelerations come to nothing [rad/s].
    rest: Vec<f64>,
    /// Another command that may be [rad/s].
    other: Vec<f64>,
    /// The first joint, counted from 0, that its position limit holds back.
    pub held_back: Option<usize>,
}

impl Envelope {
    /// For so many joints.
    pub fn new(joints: usize) -> Self {
        Self {
            spans: vec![Span::default(); joints],
            rest: vec![0.0; joints],
            other: vec![0.0; joints],
            held_back: None,
        }
    }

    /// Takes what holds in this cycle.
    pub fn enclose(&mut self, joints: &Joints) {
        self.spans.iter_mut().enumerate().for_each(|(joint, span)| *span = joints.span(joint));
    }

    /// Makes of the `velocity` that is wanted of `arms` the next command [rad/s, prismatic: m/s], one number a joint.
    pub fn admit(&mut self, joints: &Joints, arms: &Arms, velocity: &mut [f64]) {
        self.keep_range(joints, velocity);
        // The joint that was slowed may have been what kept the tool slow.
        joints.keep_speeds(arms, velocity);
        self.go_towards(velocity, joints.braking.period);
        self.slow_tool(joints, arms, velocity);
    }

    /// What of a command does not lie in the envelope, if anything.
    pub fn violation(&self, command: &[f64]) -> Option<Violation> {
        let mut joints = command.iter().zip(&self.spans).enumerate();
        joints.find_map(|(joint, (speed, span))| span.violation(joint, *speed))
    }

    /// Cuts what goes too fast for a joint, which holds up no other one by that.
    fn keep_range(&mut self, joints: &Joints, velocity: &mut [f64]) {
        let limits = &joints.limits.position;
        self.held_back = None;
        for (joint, (speed, span)) in velocity.iter_mut().zip(&self.spans).enumerate() {
            let kept = span.within_position_limits(*speed);
            if kept != *speed && limits.is_near(joint, joints.positions[joint]) {
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
        let part = self.part_of_change(velocity);
        for (speed, span) in velocity.iter_mut().zip(&self.spans) {
            let slower = span.slower_than_last(*speed).filter(|_| part * STOP_TIME < period);
            *speed = slower.map_or(span.along(*speed, part), |slower| span.towards(slower));
        }
    }

    /// The part of the change to `velocity` that all joints can make in a cycle.
    fn part_of_change(&self, velocity: &[f64]) -> f64 {
        let parts = velocity.iter().zip(&self.spans).map(|(wanted, span)| span.part_of_change(*wanted));
        parts.fold(1.0, f64::min)
    }

    /// Slows the joints to the tool's speed limits: limits may have been lowered, and what was changed for one joint alone may have made the
    /// tool faster. What counts is how fast the tool is when accelerations have come to nothing.
    ///
    /// If that is too fast although each joint is slowed down, none goes on accelerating either: under a limit on jerk it would have to be
    /// slowed down again, and the tool would be too fast again and again.
    fn slow_tool(&mut self, joints: &Joints, arms: &Arms, velocity: &mut [f64]) {
        if self.slow_at_rest(joints.limits, arms, velocity) || !joints.braking.limits_jerk() {
            return;
        }
        if self.share_at_rest(joints.limits, arms, velocity) < 1.0 {
            velocity.iter_mut().zip(&self.spans).for_each(|(speed, span)| *speed = span.eased());
            self.slow_at_rest(joints.limits, arms, velocity);
        }
    }

    /// Slows the joints towards the speeds at which the tool keeps its limits. True if it does so anyway.
    ///
    /// Each joint slows down as far as it can, or all along the line, whichever leaves the tool slower: joints that slow down by themselves
    /// turn a tool that they have kept from turning together, and a weak joint holds up the others along the line.
    fn slow_at_rest(&mut self, limits: &Limits, arms: &Arms, velocity: &mut [f64]) -> bool {
        let factor = self.share_at_rest(limits, arms, velocity);
        if factor >= 1.0 {
            return true;
        }
        scale(&mut self.rest, factor);
        let part = self.part_of_change(&self.rest);
        let wanted = self.rest.iter().zip(&self.spans);
        for ((by_itself, along), (wanted, span)) in velocity.iter_mut().zip(&mut self.other).zip(wanted) {
            (*by_itself, *along) = (span.towards(*wanted), span.along(*wanted, part));
        }
        let share = |command: &[f64]| limits.tool_share(&arms.tool_speed(command));
        if part < 1.0 && share(&self.other) > share(velocity) {
            velocity.copy_from_slice(&self.other);
        }
        false
    }

    /// The factor, at most 1, that brings the tool under its speed limits when the accelerations after that `command` have come to nothing. The
    /// speeds of the joints then are in `rest`.
    fn share_at_rest(&mut self, limits: &Limits, arms: &Arms, command: &[f64]) -> f64 {
        let joints = self.rest.iter_mut().zip(command).zip(&self.spans);
        joints.for_each(|((rest, speed), span)| *rest = span.rest(*speed));
        limits.tool_share(&arms.tool_speed(&self.rest))
    }
}
