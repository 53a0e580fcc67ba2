//! Brings a joint with limited jerk to rest, or to another speed.
//!
//! A cycle changes a joint's speed by a step. The jerk limits the change of the step from cycle to cycle. Without a limit, the jerk
//! is infinite.

/// Relative tolerance for the rounding of a step. The independent check of commands has a larger tolerance.
const ROUNDING: f64 = 1e-10;

/// The speed of a joint, and its change in the last cycle [rad/s, prismatic: m/s].
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

    /// Returns the travel until the steps have decreased to zero, divided by the control period [rad/s, prismatic: m/s]. The steps
    /// decrease as fast as `jerk` [rad/s, prismatic: m/s] allows.
    pub fn travel_to_rest(self, jerk: f64) -> f64 {
        let cycles = self.step.abs() / jerk;
        cycles * (self.speed + cycles * self.step / 3.0)
    }

    /// Returns the speed after the steps have decreased to zero [rad/s, prismatic: m/s]. The steps decrease as fast as `jerk`
    /// [rad/s, prismatic: m/s] allows.
    pub fn rest(self, jerk: f64) -> f64 {
        let more = (self.step.abs() / jerk).floor();
        if more < 1.0 {
            return self.speed;
        }
        self.speed + (more * (self.step.abs() - 0.5 * jerk * (more + 1.0))).copysign(self.step)
    }

    /// Returns the next speed of a stop [rad/s, prismatic: m/s]. In one cycle, the joint slows down by at most `most`, and the step
    /// changes by at most `jerk` [rad/s, prismatic: m/s].
    pub fn stopped(self, most: f64, jerk: f64) -> f64 {
        self.speed + self.towards(0.0, most, jerk)
    }

    /// Returns the next step toward the speed `wanted`. The step is at most `most`, and differs from the last step by at most
    /// `jerk` [rad/s, prismatic: m/s]. If the speed could reach `wanted` without overshoot before this step, it still can after
    /// this step.
    pub fn towards(self, wanted: f64, most: f64, jerk: f64) -> f64 {
        let gap = wanted - self.speed;
        let step = most.min(eased(gap.abs(), jerk)).copysign(gap);
        let change = jerk * (1.0 + ROUNDING);
        step.max(self.step - change).min(self.step + change)
    }
}

/// Returns the first of a series of steps that add up to `gap`. Each step is smaller than the previous step by `jerk`, and the
/// last step is at most `jerk`.
pub(crate) fn eased(gap: f64, jerk: f64) -> f64 {
    if jerk == f64::INFINITY {
        return gap;
    }
    let parts = gap / jerk;
    let more = (0.5 * ((1.0 + 8.0 * parts).sqrt() - 1.0)).floor();
    if more < 1.0 { gap } else { jerk * (parts / (more + 1.0) + 0.5 * more) }
}
