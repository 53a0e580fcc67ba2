//! The limit on jerk: how much the acceleration of a joint may differ from the one before.

use super::{Filter, Given, between};
use crate::servo::jerk::{Pace, eased};

/// So often the step that still fits before a position limit is looked for between two.
const HALVINGS: u32 = 20;

/// Keeps each joint to the steps from which, changing them no faster than its jerk, it comes to rest within its speed and position limits.
/// A stop is always among them.
pub(super) struct Jerk;

impl Filter for Jerk {
    fn apply(&mut self, given: &Given, velocity: &mut [f64]) {
        if !given.braking.limits_jerk() {
            return;
        }
        let limits = &given.settings.limits.position;
        for (joint, speed) in velocity.iter_mut().enumerate() {
            let (pace, position) = (given.pace(joint), given.positions[joint]);
            let down = Pace { speed: -pace.speed, step: -pace.step };
            let lowest = pace.speed - highest(given, joint, down, position - limits.lower[joint]);
            let highest = pace.speed + highest(given, joint, pace, limits.upper[joint] - position);
            *speed = between(*speed, lowest, highest);
        }
    }
}

/// The largest step up [rad/s] of that joint at that `pace`, which has so much `room` \[rad\].
fn highest(given: &Given, joint: usize, pace: Pace, room: f64) -> f64 {
    let (limits, braking) = (&given.settings.limits, &given.braking);
    let (brakes, jerk) = (limits.brakes(joint, braking), braking.jerk_step(joint));
    let faster = limits.joint_acceleration[joint] * given.period;
    let slower = braking.decelerations[joint] * given.period;
    let stop = pace.towards(0.0, slower, jerk);
    let most = match pace.speed {
        speed if speed > brakes.speed => slower,
        // No more than the acceleration is left of a deceleration where the joint turns round.
        speed if speed < 0.0 => faster.max(slower.min(eased(-speed, jerk))),
        _ => faster,
    };
    let most = pace.towards(brakes.speed, most, jerk);
    let fits = |step: f64| {
        let rest = Pace { speed: pace.speed + step, step }.rest(jerk);
        limits.position.room_needed(rest, step / brakes.period, &brakes) <= room
    };
    if fits(most) {
        return most;
    }
    let (mut fitting, mut beyond) = (stop, most);
    for _ in 0..HALVINGS {
        let half = 0.5 * (fitting + beyond);
        if fits(half) { fitting = half } else { beyond = half }
    }
    fitting
}
