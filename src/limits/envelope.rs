//! The envelope: for each joint, the speeds that its next command may have.
//!
//! From each of these speeds, a stop keeps the limits on speed, acceleration, jerk and position, even with the robot's delay and
//! with late cycles ([`Span`]). The next speed of a stop is always in the envelope, whatever the limits are, so the envelope is
//! never empty.

use crate::{Joints, Limits, STOP_TIME, Span, Violation, scale};
use dq_kinematics::arm::Arms;

/// The speeds that the joints may have in this cycle.
#[derive(Debug)]
pub struct Envelope {
    spans: Vec<Span>,
    /// The speed that each joint has once its acceleration has ended [rad/s, prismatic: m/s].
    rest: Vec<f64>,
    /// A buffer for the command with which all joints slow down along one line in joint space [rad/s, prismatic: m/s].
    other: Vec<f64>,
    /// The first joint (counted from 0) that is near its position limit and moves slower because of this limit; `None` if there is
    /// no such joint.
    pub held_back: Option<usize>,
}

impl Envelope {
    /// Allocates the buffers for this many joints.
    pub fn new(joints: usize) -> Self {
        Self {
            spans: vec![Span::default(); joints],
            rest: vec![0.0; joints],
            other: vec![0.0; joints],
            held_back: None,
        }
    }

    /// Computes, for each joint, the speeds that its next command may have.
    pub fn enclose(&mut self, joints: &Joints) {
        self.spans.iter_mut().enumerate().for_each(|(joint, span)| *span = joints.span(joint));
    }

    /// Turns the desired `velocity` of `arms` into the next command [rad/s, prismatic: m/s], one number per joint.
    pub fn admit(&mut self, joints: &Joints, arms: &Arms, velocity: &mut [f64]) {
        self.keep_range(joints, velocity);
        // A joint that was slowed down may have compensated for other joints in the tool's motion.
        joints.keep_speeds(arms, velocity);
        self.go_towards(velocity, joints.braking.period);
        self.slow_tool(joints, arms, velocity);
    }

    /// Returns the violation by the first joint whose `command` is not in the envelope [rad/s, prismatic: m/s]; `None` if every
    /// speed is in the envelope.
    pub fn violation(&self, command: &[f64]) -> Option<Violation> {
        let mut joints = command.iter().zip(&self.spans).enumerate();
        joints.find_map(|(joint, (speed, span))| span.violation(joint, *speed))
    }

    /// Limits the speed of each joint near its position limits. This does not slow the other joints.
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

    /// Moves the command from the last command toward `velocity`. All joints make the same fraction of their changes of speed: the
    /// largest fraction that every joint can make within a cycle. So the command neither jumps nor takes a detour in joint space.
    ///
    /// At this rate, the whole change may take longer than [`STOP_TIME`], for example because one joint can hardly accelerate. In
    /// this case, the joints that have to slow down brake independently.
    fn go_towards(&self, velocity: &mut [f64], period: f64) {
        let part = self.part_of_change(velocity);
        for (speed, span) in velocity.iter_mut().zip(&self.spans) {
            let slower = span.slower_than_last(*speed).filter(|_| part * STOP_TIME < period);
            *speed = slower.map_or(span.along(*speed, part), |slower| span.towards(slower));
        }
    }

    /// Returns the fraction of the change from the last command to `velocity` that every joint can make within a cycle, from 0 to 1.
    fn part_of_change(&self, velocity: &[f64]) -> f64 {
        let parts = velocity.iter().zip(&self.spans).map(|(wanted, span)| span.part_of_change(*wanted));
        parts.fold(1.0, f64::min)
    }

    /// Slows the joints so that the tool keeps its speed limits. The tool may be too fast because the limits were lowered, or because
    /// individual joints changed their speeds. This method checks the speed that the tool will have once the joints' accelerations
    /// have ended.
    ///
    /// With limited jerk, the accelerations end only after some cycles. So the tool may become too fast even after a slower command. In
    /// this case, all accelerations decrease as fast as the jerk limits allow. Otherwise the joints would speed up and slow down
    /// again and again, and the tool would be too fast each time.
    fn slow_tool(&mut self, joints: &Joints, arms: &Arms, velocity: &mut [f64]) {
        if self.slow_at_rest(joints.limits, arms, velocity) || !joints.braking.limits_jerk() {
            return;
        }
        if self.share_at_rest(joints.limits, arms, velocity) < 1.0 {
            velocity.iter_mut().zip(&self.spans).for_each(|(speed, span)| *speed = span.eased());
            self.slow_at_rest(joints.limits, arms, velocity);
        }
    }

    /// Slows the joints if the tool would exceed its speed limits once the joints' accelerations have ended. Returns true if the
    /// joints need not slow down.
    ///
    /// Computes two commands, and chooses the one with the slower tool. In the first, each joint slows down independently. This may
    /// make the tool faster, because the joints' motions no longer cancel each other. In the second, all joints slow down along one
    /// line in joint space. There, the joint with the lowest acceleration delays the others.
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

    /// Computes the joint speeds that remain when the accelerations after `command` have decreased to 0, and stores them in `rest`.
    /// Returns the factor, at most 1, by which these speeds must be scaled so that the tool keeps its speed limits.
    fn share_at_rest(&mut self, limits: &Limits, arms: &Arms, command: &[f64]) -> f64 {
        let joints = self.rest.iter_mut().zip(command).zip(&self.spans);
        joints.for_each(|((rest, speed), span)| *rest = span.rest(*speed));
        limits.tool_share(&arms.tool_speed(&self.rest))
    }
}
