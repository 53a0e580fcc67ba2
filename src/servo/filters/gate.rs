//! The last gate: no command leaves the servo that is not finite and within the limits, however it was made.

use super::stop::Stop;
use super::{Filter, Given};
use crate::servo::{Limits, Violation};

/// Room for rounding, relative.
const ROUNDING: f64 = 1e-9;

/// Commands that were replaced by braking.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Replaced {
    /// How many.
    pub count: u64,
    /// What was wrong with the last of them.
    pub last: Option<Violation>,
}

/// Lets a velocity pass that may follow the command before, which passed; else replaces it by what brakes from there.
#[derive(Default)]
pub(super) struct Gate {
    pub replaced: Replaced,
}

impl Filter for Gate {
    fn apply(&mut self, given: &Given, velocity: &mut [f64]) {
        let Given { before, braking, period, .. } = *given;
        let joints = velocity.iter().zip(before).zip(braking.decelerations).enumerate();
        let mut found =
            joints.filter_map(|(joint, ((now, before), deceleration))| match jerk(given, joint, *now) {
                Jerk::AsAStop => None,
                Jerk::TooMuch(violation) => Some(violation),
                Jerk::Taken => {
                    violation(joint, *now, *before, &given.settings.limits, deceleration * period, period)
                }
            });
        if let Some(violation) = found.next() {
            self.replaced = Replaced { count: self.replaced.count + 1, last: Some(violation) };
            Stop.apply(given, velocity);
        }
    }
}

/// How a speed keeps the limit on jerk.
enum Jerk {
    Taken,
    /// Where limits were lowered that alone may be possible, and it is always right.
    AsAStop,
    TooMuch(Violation),
}

/// How the speed `now` [rad/s] of that joint keeps the limit on jerk.
fn jerk(given: &Given, joint: usize, now: f64) -> Jerk {
    let (pace, limit) = (given.pace(joint), given.braking.jerk_step(joint));
    if limit.is_infinite() {
        return Jerk::Taken;
    }
    let (step, slower) = (now - pace.speed, given.braking.decelerations[joint] * given.period);
    let (change, rounding) = ((step - pace.step).abs(), limit * ROUNDING + 4.0 * f64::EPSILON * now.abs());
    if (step - pace.towards(0.0, slower, limit)).abs() <= rounding {
        Jerk::AsAStop
    } else if change > limit + rounding {
        Jerk::TooMuch(Violation::Jerk { joint: joint + 1, change, limit })
    } else {
        Jerk::Taken
    }
}

/// What is wrong with the speed `now` after `before` [rad/s] of the joint number `joint`, which may slow down by `slower` [rad/s].
/// Every comparison is so that what is not a number fails it.
fn violation(
    joint: usize,
    now: f64,
    before: f64,
    limits: &Limits,
    slower: f64,
    period: f64,
) -> Option<Violation> {
    let (faster, velocity) = (limits.joint_acceleration[joint] * period, limits.joint_velocity[joint]);
    let slows_down = now * before >= 0.0 && now.abs() <= before.abs();
    let step = (now - before).abs();
    let most = if slows_down { faster.max(slower) } else { faster };
    let within = |value: f64, limit: f64| value <= limit * (1.0 + ROUNDING) + f64::EPSILON * before.abs();
    let joint = joint + 1;
    if !now.is_finite() {
        Some(Violation::NonFinite { joint, value: now })
    } else if !(slows_down || within(now.abs(), velocity)) {
        Some(Violation::Velocity { joint, speed: now, limit: velocity })
    } else if !within(step, most) {
        Some(Violation::Acceleration { joint, step, limit: most })
    } else {
        None
    }
}
