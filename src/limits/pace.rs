//! Brings a joint with limited jerk to rest, or to another speed.
//!
//! A *step* is the change of a joint's speed in one cycle [rad/s, prismatic: m/s]. The jerk limits the difference between the steps
//! of two successive cycles: the argument `jerk` of each function is the largest such difference [rad/s, prismatic: m/s]. It is
//! infinite for a joint without a jerk limit.

/// Relative tolerance for the rounding of a step. The tests, which check the commands independently, have a larger tolerance.
const ROUNDING: f64 = 1e-10;

/// The speed of a joint, and the change of this speed in the last cycle [rad/s, prismatic: m/s].
#[derive(Clone, Copy, Debug, Default)]
pub struct Pace {
    /// The speed.
    pub speed: f64,
    /// The change of the speed in the last cycle.
    pub step: f64,
}

impl Pace {
    /// Returns the pace with the signs of speed and step reversed.
    pub fn mirrored(self) -> Self {
        Self { speed: -self.speed, step: -self.step }
    }

    /// Returns the distance that the joint travels until its speed no longer changes, divided by the control period [rad/s,
    /// prismatic: m/s]. The size of the change per cycle, `step`, decreases by `jerk` in each cycle.
    pub fn travel_to_rest(self, jerk: f64) -> f64 {
        let cycles = self.step.abs() / jerk;
        cycles * (self.speed + cycles * self.step / 3.0)
    }

    /// Returns the speed that the joint has when its speed no longer changes [rad/s, prismatic: m/s]. The size of the change per
    /// cycle, `step`, decreases by `jerk` in each cycle.
    pub fn rest(self, jerk: f64) -> f64 {
        let more = (self.step.abs() / jerk).floor();
        if more < 1.0 {
            return self.speed;
        }
        self.speed + (more * (self.step.abs() - 0.5 * jerk * (more + 1.0))).copysign(self.step)
    }

    /// Returns the next speed of a joint that brakes to rest. In one cycle, the speed changes by at most `most`, and this change
    /// differs from the change in the previous cycle by at most `jerk`. All are in rad/s, for prismatic joints in m/s.
    pub fn stopped(self, most: f64, jerk: f64) -> f64 {
        self.speed + self.towards(0.0, most, jerk)
    }

    /// Returns the change of speed in the next cycle toward the speed `wanted`. The change is at most `most`, and differs from the
    /// change in the previous cycle by at most `jerk`. All are in rad/s, for prismatic joints in m/s. If the joint can now reach
    /// `wanted` without overshoot, it can still do so after this change.
    pub fn towards(self, wanted: f64, most: f64, jerk: f64) -> f64 {
        let gap = wanted - self.speed;
        let step = most.min(eased(gap.abs(), jerk)).copysign(gap);
        let change = jerk * (1.0 + ROUNDING);
        step.max(self.step - change).min(self.step + change)
    }
}

/// Returns the change of speed in the next cycle, the first of several changes that add up to `gap`. `gap` is the difference from
/// the wanted speed. Each change is smaller than the previous change by `jerk`, and the final change is at most `jerk`. All are in
/// rad/s, for prismatic joints in m/s.
pub(crate) fn eased(gap: f64, jerk: f64) -> f64 {
    if jerk == f64::INFINITY {
        return gap;
    }
    let parts = gap / jerk;
    let more = (0.5 * ((1.0 + 8.0 * parts).sqrt() - 1.0)).floor();
    if more < 1.0 { gap } else { jerk * (parts / (more + 1.0) + 0.5 * more) }
}
