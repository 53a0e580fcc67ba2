//! How a joint comes to rest, or to another speed, whose acceleration may not step.
//!
//! A cycle changes a joint's speed by a step, and the step by no more than its jerk allows. Without a limit on that, jerks are infinite.

/// Room for rounding in what a cycle changes, relative: less than what the gate has.
const ROUNDING: f64 = 1e-10;

/// A jerk beyond this [rad/s³] is none.
const NONE: f64 = 1e12;

/// How fast a joint goes, and by what the last cycle has changed that [rad/s, prismatic: m/s].
#[derive(Clone, Copy, Debug)]
pub(super) struct Pace {
    pub speed: f64,
    pub step: f64,
}

impl Pace {
    /// The speed [rad/s] at which it goes on where its steps come to nothing as fast as such a `jerk` [rad/s] allows.
    pub fn rest(self, jerk: f64) -> f64 {
        let more = (self.step.abs() / jerk).floor();
        if more < 1.0 {
            return self.speed;
        }
        self.speed + (more * (self.step.abs() - 0.5 * jerk * (more + 1.0))).copysign(self.step)
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
pub(super) fn eased(gap: f64, jerk: f64) -> f64 {
    let parts = gap / jerk;
    let more = (0.5 * ((1.0 + 8.0 * parts).sqrt() - 1.0)).floor();
    if more < 1.0 { gap } else { jerk * (parts / (more + 1.0) + 0.5 * more) }
}

/// A stop in the shortest time: the acceleration changes at the jerk until it is the deceleration, stays so, and changes back to nothing.
#[derive(Clone, Copy, Debug)]
pub(super) struct StopProfile {
    /// 1 where it ends ahead of where the speed was 0 last, else −1; what follows is times that.
    sign: f64,
    speed: f64,
    acceleration: f64,
    deceleration: f64,
    jerk: f64,
    /// What the first part has of the jerk: the other sign where it slows down too hard.
    first_jerk: f64,
    /// How long the first two parts last \[s\]; the third lasts as long as the jerk needs.
    ramp: f64,
    hold: f64,
}

impl StopProfile {
    /// With this `acceleration` [rad/s²] of a joint that would go on at the speed `rest` [rad/s] if that came to nothing, with this
    /// deceleration [rad/s²] and jerk [rad/s³].
    pub fn new(rest: f64, acceleration: f64, deceleration: f64, jerk: f64) -> Self {
        let jerk = jerk.min(NONE);
        let sign = 1_f64.copysign(rest);
        let acceleration = sign * acceleration;
        let speed = rest.abs() - 0.5 * acceleration * acceleration.abs() / jerk;
        let square = jerk * speed + 0.5 * acceleration * acceleration;
        let deceleration = square.max(0.0).sqrt().min(deceleration);
        let first_jerk = jerk.copysign(acceleration + deceleration);
        let ramp = (acceleration + deceleration) / first_jerk;
        let left = speed + ramp * (acceleration - 0.5 * first_jerk * ramp);
        let hold = if deceleration > 0.0 { left / deceleration - 0.5 * deceleration / jerk } else { 0.0 };
        Self { sign, speed, acceleration, deceleration, jerk, first_jerk, ramp, hold: hold.max(0.0) }
    }

    /// How long it takes \[s\].
    pub fn duration(&self) -> f64 {
        self.ramp + self.hold + self.deceleration / self.jerk
    }

    /// How far the joint has gone after that `time` \[s\] of it \[rad\].
    pub fn way(&self, time: f64) -> f64 {
        let Self { speed, acceleration, deceleration, jerk, first_jerk, ramp, hold, .. } = *self;
        let first = time.min(ramp);
        let second = (time - ramp).max(0.0).min(hold);
        let third = (time - ramp - hold).max(0.0).min(deceleration / jerk);
        let then = speed + first * (acceleration - 0.5 * first_jerk * first);
        let last = then - deceleration * second;
        self.sign
            * (first * (speed + first * (0.5 * acceleration - first_jerk * first / 6.0))
                + second * (then - 0.5 * deceleration * second)
                + third * (last - third * (0.5 * deceleration - jerk * third / 6.0)))
    }

    /// How far it goes the other way at first \[rad\], where it has to turn round.
    pub fn aside(&self) -> f64 {
        if self.speed >= 0.0 {
            return 0.0;
        }
        let square = self.acceleration * self.acceleration + 2.0 * self.jerk * self.speed;
        let turns = (self.acceleration - square.max(0.0).sqrt()) / self.jerk;
        self.way(turns).abs()
    }

    /// How far it goes ahead at most \[rad\].
    pub fn ahead(&self) -> f64 {
        if self.sign > 0.0 { self.way(self.duration()).max(0.0) } else { self.aside() }
    }

    /// The largest speed ahead \[rad/s\].
    pub fn fastest(&self) -> f64 {
        let rise = self.sign * self.acceleration;
        (self.sign * self.speed + rise.max(0.0).powi(2) / (2.0 * self.jerk)).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const PERIOD: f64 = 0.002;

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

        /// The profile is within what the joint goes in two cycles of the way that the steps of the cycles go.
        #[test]
        fn a_stop_goes_the_way_of_its_profile(
            speed in -3.0..3.0f64, acceleration in -30.0..30.0f64, deceleration in 3.0..30.0f64, jerk in 2.0..5.0f64,
        ) {
            let jerk = 10f64.powf(jerk).max(5.0 * deceleration.max(acceleration.abs()));
            let (mut pace, mut way) = (Pace { speed, step: PERIOD * acceleration }, 0.0);
            let profile = StopProfile::new(pace.rest(PERIOD * PERIOD * jerk), acceleration, deceleration, jerk);
            let fastest = speed.abs() + 0.5 * acceleration * acceleration / jerk;
            let (mut least, mut most) = (0.0_f64, 0.0_f64);
            for cycle in 1..2000_u32 {
                let step = pace.towards(0.0, PERIOD * deceleration, PERIOD * PERIOD * jerk);
                pace = Pace { speed: pace.speed + step, step };
                way += PERIOD * pace.speed;
                (least, most) = (least.min(way), most.max(way));
                let profiled = profile.way(PERIOD * f64::from(cycle));
                prop_assert!((way - profiled).abs() <= 2.0 * PERIOD * fastest + 1e-6, "{way} instead of {profiled}");
            }
            prop_assert!(pace.speed == 0.0 && pace.step == 0.0);
            prop_assert!(most <= profile.ahead() + 2.0 * PERIOD * fastest + 1e-6, "{most} {}", profile.ahead());
        }
    }
}
