//! Computes the speed of an arm from its joint states. When a servo shuts down, the speed shows whether the arm stands still.

use dq_core::servo::JointOrder;
use dq_messages::messages::JointState;
use std::time::{Duration, Instant};

/// The least time between two positions from which a speed is computed.
const LEAST_TIME: Duration = Duration::from_millis(20);

/// The speed of an arm.
#[derive(Default)]
pub(super) struct ArmSpeed {
    /// The speed of the fastest joint [rad/s, prismatic: m/s]; `None` if the last joint state lacks the speed of a joint. This is the
    /// lower of the reported speed and the speed computed from the positions, because some drivers report other quantities as speeds.
    pub fastest: Option<f64>,
    /// The positions \[rad, prismatic: m\] from which the next speed will be computed, and the time at which they arrived.
    before: Option<(Instant, Vec<f64>)>,
    /// The speed that was last computed from the positions, for the fastest joint [rad/s, prismatic: m/s]; `None` before the first
    /// computation.
    shown: Option<f64>,
}

impl ArmSpeed {
    /// Takes a joint state that arrived at `now`. Ignores joints that are not in `joints`, such as those of a gripper or wheels.
    pub fn hear(&mut self, joints: &JointOrder, state: &JointState, now: Instant) {
        let value = |of: &[f64], joint: &String| {
            let place = state.name.iter().position(|name| name == joint)?;
            of.get(place).copied().filter(|value| value.is_finite())
        };
        let positions =
            || joints.names().iter().map(|joint| value(&state.position, joint).unwrap_or_default());
        match &mut self.before {
            Some((then, before)) if now.saturating_duration_since(*then) >= LEAST_TIME => {
                let ways = before.iter().zip(positions()).map(|(before, now)| (now - before).abs());
                let seconds = now.saturating_duration_since(*then).as_secs_f64();
                self.shown = Some(ways.fold(0.0, f64::max) / seconds);
                *then = now;
                before.clear();
                before.extend(positions());
            }
            Some(_) => {}
            None => self.before = Some((now, positions().collect())),
        }
        let mut speeds = joints.names().iter().map(|joint| value(&state.velocity, joint).map(f64::abs));
        let reported = speeds.try_fold(0.0, |fastest, speed| Some(f64::max(fastest, speed?)));
        let reported = reported.filter(|_| state.velocity.len() == state.name.len());
        self.fastest = reported.map(|reported| self.shown.map_or(reported, |shown| shown.min(reported)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NAMES: [&str; 3] = ["wheel", "elbow", "shoulder"];

    fn state(position: &[f64], velocity: &[f64]) -> JointState {
        let name = NAMES.iter().take(position.len()).map(|name| (*name).to_owned()).collect();
        JointState { name, position: position.to_vec(), velocity: velocity.to_vec(), ..JointState::default() }
    }

    fn joints() -> JointOrder {
        JointOrder::new(["shoulder", "elbow"].map(str::to_owned).to_vec())
    }

    #[test]
    fn only_the_arm_s_own_joints_say_whether_it_stands() {
        let speed = |count: usize, velocity: &[f64]| {
            let mut speed = ArmSpeed::default();
            speed.hear(&joints(), &state(&[0.0; 3][..count], velocity), Instant::now());
            speed.fastest
        };
        assert_eq!(speed(3, &[9.0, 0.1, -0.2]), Some(0.2));
        assert_eq!(speed(3, &[9.0, 0.0, 0.0]), Some(0.0));
        assert_eq!(speed(3, &[0.0, f64::NAN, 0.0]), None);
        assert_eq!(speed(2, &[0.0, 0.0]), None);
        assert_eq!((speed(3, &[]), speed(3, &[0.0, 0.0])), (None, None));
    }

    #[test]
    fn an_arm_whose_positions_stay_stands_whatever_velocities_are_reported() {
        let (start, mut speed) = (Instant::now(), ArmSpeed::default());
        let mut hear = |milliseconds, angle: f64| {
            let state = state(&[7.0, angle, 1.0], &[0.0, 3.0, 3.0]);
            speed.hear(&joints(), &state, start + Duration::from_millis(milliseconds));
            speed.fastest.unwrap()
        };
        assert_eq!((hear(0, 0.0), hear(10, 0.01)), (3.0, 3.0));
        assert!((hear(20, 0.02) - 1.0).abs() < 1e-9);
        assert!((hear(40, 0.02), hear(50, 0.02)) == (0.0, 0.0));
    }
}
