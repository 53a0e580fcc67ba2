//! How a joint comes to rest, or to another speed, whose acceleration may not step.
//!
//! A cycle changes a joint's speed by a step, and the step by no more than its jerk allows. Without a limit on that, jerks are infinite.

/// Room for rounding in what a cycle changes, relative: less than what the invariants have.
const ROUNDING: f64 = 1e-10;

/// How fast a joint goes, and by what the last cycle has changed that [rad/s, prismatic: m/s].
#[derive(Clone, Copy, Debug, Default)]
pub struct Pace {
    /// How fast it goes.
    pub speed: f64,
    /// By what the last cycle has changed that.
    pub step: f64,
}

impl Pace {
    /// The same in the other direction.
    pub fn mirrored(self) -> Self {
        Self { speed: -self.speed, step: -self.step }
    }

    /// How far it goes until its steps come to nothing as fast as such a `jerk` [rad/s] allows, in cycles at 1 rad/s.
    pub fn travel_to_rest(self, jerk: f64) -> f64 {
        let cycles = self.step.abs() / jerk;
        cycles * (self.speed + cycles * self.step / 3.0)
    }

    /// The speed [rad/s] at which it goes on where its steps come to nothing as fast as such a `jerk` [rad/s] allows.
    pub fn rest(self, jerk: f64) -> f64 {
        let more = (self.step.abs() / jerk).floor();
        if more < 1.0 {
            return self.speed;
        }
        self.speed + (more * (self.step.abs() - 0.5 * jerk * (more + 1.0))).copysign(self.step)
    }

    /// The next speed [rad/s] of a stop, in which a cycle slows down by at most `most`.
    pub fn stopped(self, most: f64, jerk: f64) -> f64 {
        self.speed + self.towards(0.0, most, jerk)
    }

    /// The next step towards the speed `wanted`, of at most `most`, and by at most `jerk` [rad/s] another one than the last. Those after it
    /// can come to nothing at that speed, if this one could.
    pub fn towards(self, wanted: f64, most: f64, jerk: f64) -> f64 {
        let gap = wanted - self.speed;
        let step = most.min(eased(gap.abs(), jerk)).copysign(gap);
        let change = jerk * (1.0 + ROUNDING);
        step.max(self.step - change).min(self.step + change)
    }
}

/// The first of the steps that add up to `gap` where each is by `jerk` smaller than the one before and the last is no larger than it.
pub(crate) fn eased(gap: f64, jerk: f64) -> f64 {
    if jerk == f64::INFINITY {
        return gap;
    }
    let parts = gap / jerk;
    let more = (0.5 * ((1.0 + 8.0 * parts).sqrt() - 1.0)).floor();
    if more < 1.0 { gap } else { jerk * (parts / (more + 1.0) + 0.5 * more) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]

        #[test]
        fn steps_that_are_eased_come_to_nothing_at_the_speed_that_is_wanted(gap in 1e-3..10.0f64, jerk in 1e-5..1.0f64) {
            let (mut pace, mut most) = (Pace { speed: 0.0, step: eased(gap, jerk) }, f64::INFINITY);
            for _ in 0..3000 {
                let step = pace.towards(gap, f64::INFINITY, jerk);
                pace = Pace { speed: pace.speed + step, step };
                prop_assert!(pace.speed <= gap + 1e-9 && step <= most + 1e-9, "{pace:?}");
                most = (step - jerk).max(0.0);
            }
            prop_assert!((pace.speed - gap).abs() < 1e-9 && pace.step.abs() < 1e-9, "{pace:?}");
        }
    }
}
