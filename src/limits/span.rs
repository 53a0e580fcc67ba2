//! The speeds that one joint may have in a cycle.

use crate::pace::eased;
use crate::{Joints, Pace, Violation, between, ratio};

/// The range of the next command of a joint [rad/s, prismatic: m/s].
#[derive(Clone, Copy, Debug, Default)]
pub struct Span {
    /// The joint's speed after the last command, and the change of its speed by that command.
    pace: Pace,
    /// The largest increase of the speed per cycle [rad/s, prismatic: m/s].
    faster: f64,
    /// The largest decrease of the speed per cycle [rad/s, prismatic: m/s].
    slower: f64,
    /// The largest difference between the changes of speed in two successive cycles [rad/s, prismatic: m/s].
    jerk: f64,
    /// The range of speeds from which the joint stops before its position limits [rad/s, prismatic: m/s].
    positions: (f64, f64),
    /// The range of speeds that are within the velocity limit and from which the joint stops before its position limits [rad/s,
    /// prismatic: m/s]. A joint whose speed is outside this range slows down into the range.
    pub range: (f64, f64),
    /// The range of the joint's next command [rad/s, prismatic: m/s].
    pub(crate) next: (f64, f64),
}

impl Joints<'_> {
    /// Returns the range of speeds of joint number `joint` in this cycle.
    pub fn span(&self, joint: usize) -> Span {
        let Self { limits, braking, .. } = self;
        let (position, pace) = (self.positions[joint], self.pace(joint));
        let (approach, jerk) = (limits.approach(joint, braking), braking.jerk_step(joint));
        // The joint moves on until its acceleration has decreased to zero. The distance of this motion is not available for
        // braking.
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
        // The next speed of a stop is within the range by construction, apart from rounding.
        let (stop, down) = (pace.stopped(span.slower, jerk), -span.highest(pace.mirrored(), -span.range.0));
        span.next = (stop.min(down), stop.max(span.highest(pace, span.range.1)));
        span
    }
}

impl Span {
    /// Returns the largest next speed of a joint at `pace` after which the joint can still stay at or below the speed `top`. `top`
    /// must be at least 0.
    fn highest(&self, pace: Pace, top: f64) -> f64 {
        let most = match pace.speed {
            speed if speed > top => self.slower,
            // If the joint reverses, a deceleration above the acceleration limit must end at rest.
            speed if speed < 0.0 => self.faster.max(self.slower.min(eased(-speed, self.jerk))),
            _ => self.faster,
        };
        pace.speed + pace.towards(top, most, self.jerk)
    }

    /// Returns the speed nearest to `speed` that the next command may have.
    pub fn hold(&self, speed: f64) -> f64 {
        between(speed, self.next.0, self.next.1)
    }

    /// Returns the speed nearest to `speed` from which the joint stops before its position limits.
    pub(crate) fn within_position_limits(&self, speed: f64) -> f64 {
        between(speed, self.positions.0, self.positions.1)
    }

    /// Returns the next speed of a joint that changes its speed to `wanted` independently of the other joints.
    pub(crate) fn towards(&self, wanted: f64) -> f64 {
        self.hold(self.pace.speed + self.pace.towards(wanted, f64::INFINITY, self.jerk))
    }

    /// Returns the fraction, from 0 to 1, of the change from the last speed to `wanted` that the limits allow within a cycle.
    pub(crate) fn part_of_change(&self, wanted: f64) -> f64 {
        let change = (wanted - self.pace.speed).abs();
        ratio(self.faster.min(eased(change, self.jerk)), change)
    }

    /// Returns the next speed: the last speed plus the fraction `part` of the difference from `wanted`.
    pub(crate) fn along(&self, wanted: f64, part: f64) -> f64 {
        // For the whole change, the sum would have a rounding error.
        let along = if part < 1.0 { self.pace.speed + part * (wanted - self.pace.speed) } else { wanted };
        self.hold(along)
    }

    /// Returns the speed between the last speed and 0 that is nearest to `wanted`; `None` if the nearest speed is the last speed,
    /// because the joint then need not slow down.
    pub(crate) fn slower_than_last(&self, wanted: f64) -> Option<f64> {
        let last = self.pace.speed;
        let slower = between(wanted, last.min(0.0), last.max(0.0));
        (slower != last).then_some(slower)
    }

    /// Returns the next speed of the joint if its acceleration decreases as fast as the jerk limit allows.
    pub(crate) fn eased(&self) -> f64 {
        let step = (self.pace.step.abs() - self.jerk).max(0.0).copysign(self.pace.step);
        self.hold(self.pace.speed + step)
    }

    /// Returns the joint's final speed if its next command is `speed` and its acceleration then decreases to 0 [rad/s, prismatic:
    /// m/s].
    pub(crate) fn rest(&self, speed: f64) -> f64 {
        Pace { speed, step: speed - self.pace.speed }.rest(self.jerk)
    }

    /// Returns the violation if `speed` must not be the next command of joint number `joint`.
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
