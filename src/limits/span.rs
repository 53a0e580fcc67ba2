//! What one joint may do in a cycle.

use crate::pace::eased;
use crate::{Joints, Pace, Violation, between, ratio};

/// Between which speeds [rad/s, prismatic: m/s] the next command of a joint may be.
#[derive(Clone, Copy, Debug, Default)]
pub struct Span {
    /// How the last command has left it.
    pace: Pace,
    /// By what a cycle may make it faster and slower, and by what it may change that [rad/s].
    faster: f64,
    slower: f64,
    jerk: f64,
    /// Between which speeds it stops before its position limits.
    positions: (f64, f64),
    /// The lowest and the highest speed to which it may come in time \[rad/s, prismatic: m/s\], and those that its next command may have.
    pub range: (f64, f64),
    pub(crate) next: (f64, f64),
}

impl Joints<'_> {
    /// What the joint number `joint` may do in this cycle.
    pub fn span(&self, joint: usize) -> Span {
        let Self { limits, braking, .. } = self;
        let (position, pace) = (self.positions[joint], self.pace(joint));
        let (approach, jerk) = (limits.approach(joint, braking), braking.jerk_step(joint));
        // What an acceleration takes to come to nothing is gone before the joint can slow down.
        let top = |pace: Pace, room: f64| {
            approach.speed(room - (braking.cycle * pace.travel_to_rest(jerk)).max(0.0))
        };
        let (lower, upper) = (limits.position.lower[joint], limits.position.upper[joint]);
        let (lowest, highest) = (-top(pace.mirrored(), position - lower), top(pace, upper - position));
        let velocity = self.velocity(joint);
        let mut span = Span {
            pace,
            faster: limits.joint_acceleration[joint] * braking.period,
            slower: braking.decelerations[joint] * braking.period,
            jerk,
            positions: (lowest, highest),
            range: (lowest.max(-velocity), highest.min(velocity)),
            next: (0.0, 0.0),
        };
        // The stop lies in it by how it is computed; this is for rounding.
        let (stop, down) = (pace.stopped(span.slower, jerk), -span.highest(pace.mirrored(), -span.range.0));
        span.next = (stop.min(down), stop.max(span.highest(pace, span.range.1)));
        span
    }
}

impl Span {
    /// The largest next speed at that `pace` of a joint that may come to the speed `top`, which is not below 0.
    fn highest(&self, pace: Pace, top: f64) -> f64 {
        let most = match pace.speed {
            speed if speed > top => self.slower,
            // No more than the acceleration is left of a deceleration where the joint turns round.
            speed if speed < 0.0 => self.faster.max(self.slower.min(eased(-speed, self.jerk))),
            _ => self.faster,
        };
        pace.speed + pace.towards(top, most, self.jerk)
    }

    /// The nearest speed that the next command may have.
    pub fn hold(&self, speed: f64) -> f64 {
        between(speed, self.next.0, self.next.1)
    }

    /// The nearest speed from which the joint stops before its position limits.
    pub(crate) fn within_position_limits(&self, speed: f64) -> f64 {
        between(speed, self.positions.0, self.positions.1)
    }

    /// The next speed towards `wanted` of a joint that goes there by itself.
    pub(crate) fn towards(&self, wanted: f64) -> f64 {
        self.hold(self.pace.speed + self.pace.towards(wanted, f64::INFINITY, self.jerk))
    }

    /// The part of the change to the speed `wanted` that the acceleration limit allows in a cycle.
    pub(crate) fn part_of_change(&self, wanted: f64) -> f64 {
        let change = (wanted - self.pace.speed).abs();
        ratio(self.faster.min(eased(change, self.jerk)), change)
    }

    /// The next speed after that part of the change to `wanted`.
    pub(crate) fn along(&self, wanted: f64, part: f64) -> f64 {
        // The sum would be rounded where all of the change is made.
        let along = if part < 1.0 { self.pace.speed + part * (wanted - self.pace.speed) } else { wanted };
        self.hold(along)
    }

    /// What of the change to `wanted` is slowing down, if any is.
    pub(crate) fn slower_than_last(&self, wanted: f64) -> Option<f64> {
        let last = self.pace.speed;
        let slower = between(wanted, last.min(0.0), last.max(0.0));
        (slower != last).then_some(slower)
    }

    /// The next speed of a joint whose acceleration comes to nothing.
    pub(crate) fn eased(&self) -> f64 {
        let step = (self.pace.step.abs() - self.jerk).max(0.0).copysign(self.pace.step);
        self.hold(self.pace.speed + step)
    }

    /// The speed at which the joint goes on from that next `speed` where its acceleration comes to nothing.
    pub(crate) fn rest(&self, speed: f64) -> f64 {
        Pace { speed, step: speed - self.pace.speed }.rest(self.jerk)
    }

    /// What is wrong with `speed` as the next command of the joint number `joint`, if anything is.
    pub(crate) fn violation(&self, joint: usize, speed: f64) -> Option<Violation> {
        let (lowest, highest) = self.next;
        let joint = joint + 1;
        match speed {
            speed if !speed.is_finite() => Some(Violation::NonFinite { joint, value: speed }),
            speed if (lowest..=highest).contains(&speed) => None,
            speed => Some(Violation::Envelope { joint, speed, lowest, highest }),
        }
    }
}
