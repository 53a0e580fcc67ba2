//! What pulls at the joints of an arm that takes velocities, and what holds them against it.
//!
//! A servo of velocities stands only where nothing pulls: under a torque τ that it does not know of, a payload's or gravity's, it goes
//! slower than commanded by d = τ/k_v, and sinks at that speed where zero is commanded. The reference position θ_r that the commands θ̇
//! integrate to runs away from the arm then, θ̇_r − θ̇_m = d, and so many times its lead is sent besides:
//!
//! ```text
//! trim = K_I (θ_r − θ_m),   θ̇_r = θ̇   ⇒   trim → d at the rate K_I, and θ̇_m → θ̇
//! ```
//!
//! Where nothing pulls the lead is 0, and the law is what it is without. In the form below, `ḋ̂ = K_I (θ̇ + trim − θ̇_m − d̂)`, what is not
//! sent, as a limit or the servo itself holds it back, is not waited for either: it winds up nothing.

use dq_limits::{Joints, Pace};
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// Where nothing is sent against it, it is watched at this rate [1/s].
const WATCHED: f64 = 2.0;

/// The rate times the delay is kept below this: half of what is stable by the small-gain theorem.
const STABLE: f64 = 0.5;

/// Whatever seems to pull faster than this part of the joint's largest speed is no weight.
const LARGEST: f64 = 0.2;

/// The faster a joint is commanded to go, the more a delay that is not known well looks like a weight: up to here [rad/s, prismatic: m/s]
/// it is observed ever less, and beyond not at all. A weight is still there when the joint goes slowly.
const FAST: f64 = 0.1;

/// A joint that was not seen to follow yet gets no more than this [rad/s, prismatic: m/s], twice the speed at which it is tried.
const UNSEEN: f64 = 0.1;

/// The part of a joint's acceleration that is left for it. So an arm that does not obey, which is said within 0.15 s, is sent little more.
const SHARE: f64 = 0.1;

/// So many times its distance from a position limit a joint is sent towards it besides the command [1/s], and not past it.
const OUTWARD: f64 = 5.0;

/// What pulls at the joints of one arm.
#[derive(Serialize, Deserialize)]
pub(crate) struct Sag {
    /// How much slower each joint goes than it is commanded [rad/s, prismatic: m/s].
    speeds: Vec<f64>,
    /// What each is sent besides, and by what the last cycle has changed that.
    trim: Vec<f64>,
    steps: Vec<f64>,
    /// Whether the arm was driven since it came, or since it last did not obey: what nobody has driven is held by nobody.
    driven: bool,
    /// Until when commands were compared with what the joints did; none where nothing was yet.
    pub compared: Option<Duration>,
}

/// What is to be held.
#[derive(Clone, Copy)]
pub enum Hold {
    /// Nothing.
    Nothing,
    /// An arm that is to stand.
    Standing,
    /// An arm that is driven.
    Driven,
}

/// The rate at which it is observed [1/s], where the parameter is `integral` and the robot is late by `delay` \[s\].
pub(crate) fn observed_at(integral: f64, delay: f64) -> f64 {
    let rate = if integral > 0.0 { integral } else { WATCHED };
    rate.min(STABLE / delay.max(f64::MIN_POSITIVE))
}

impl Sag {
    pub fn new(joint_count: usize) -> Self {
        let zeros = vec![0.0; joint_count];
        Self { speeds: zeros.clone(), trim: zeros.clone(), steps: zeros, driven: false, compared: None }
    }

    /// Nothing is known of a robot that has come, or that does not obey.
    pub fn forget(&mut self) {
        self.speeds.fill(0.0);
        self.trim.fill(0.0);
        self.steps.fill(0.0);
        (self.driven, self.compared) = (false, None);
    }

    /// How much slower than commanded each joint goes [rad/s, prismatic: m/s].
    pub fn speeds(&self) -> &[f64] {
        &self.speeds
    }

    /// What each joint is sent besides its command [rad/s, prismatic: m/s].
    pub fn trim(&self) -> &[f64] {
        &self.trim
    }

    /// Joints have `moved` in the time `passed` by so much, each of them, where they were commanded to go as far as `asked`; observed at `rate` [1/s],
    /// of joints with these largest speeds [rad/s].
    pub fn observe(
        &mut self,
        moved: impl Iterator<Item = f64>,
        asked: impl Iterator<Item = f64>,
        passed: Duration,
        rate: f64,
        largest: &[f64],
    ) {
        let passed = passed.as_secs_f64();
        let joints = self.speeds.iter_mut().zip(&self.trim).zip(largest);
        for (((speed, trim), largest), (moved, asked)) in joints.zip(moved.zip(asked)) {
            let slow = (1.0 - (asked / passed.max(f64::MIN_POSITIVE)).abs() / FAST).max(0.0);
            let change = slow * rate * (asked - moved + passed * (trim - *speed));
            *speed = (*speed + change).max(-LARGEST * largest).min(LARGEST * largest);
        }
    }

    /// Brings what is sent besides the `command` of all `joints` nearer to what it should be, or to 0, within the limits that the command
    /// leaves. The arm's joints are those from the number `first` on; `seen` says whether it was seen to follow.
    pub fn hold(&mut self, hold: Hold, seen: bool, joints: &Joints, first: usize, command: &[f64]) {
        let Joints { limits, positions, before, braking } = joints;
        self.driven |= matches!(hold, Hold::Driven);
        let is_held = self.driven && !matches!(hold, Hold::Nothing);
        for ((trim, last), (joint, speed)) in
            self.trim.iter_mut().zip(&mut self.steps).zip((first..).zip(&self.speeds))
        {
            let most = if seen { f64::INFINITY } else { UNSEEN };
            let wanted = if is_held { speed.max(-most).min(most) } else { 0.0 };
            let faster = braking.period * limits.joint_acceleration[joint];
            let jerk = braking.jerk_step(joint);
            let step = Pace { speed: *trim, step: *last }.towards(wanted, SHARE * faster, jerk);
            // Of the acceleration and of the jerk it has what the command leaves.
            let commanded = command[joint] - before[joint];
            let step = step.max((-faster - commanded).min(0.0)).min((faster - commanded).max(0.0));
            let before = *last + braking.steps[joint] - commanded;
            let next = *trim + step.max(before - jerk).min(before + jerk);
            // It takes no command out of the limits; one that is outside, as they were lowered, is brought inside by the envelope.
            let (largest, now) = (limits.joint_velocity[joint], command[joint]);
            let (lower, upper) = ((-largest - now).min(0.0), (largest - now).max(0.0));
            let down = (positions[joint] - limits.position.lower[joint]).max(0.0);
            let up = (limits.position.upper[joint] - positions[joint]).max(0.0);
            let next = next.max(lower.max(-OUTWARD * down)).min(upper.min(OUTWARD * up));
            (*trim, *last) = (next, next - *trim);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dq_limits::{Braking, Limits, PositionLimits};
    use proptest::prelude::*;

    const PERIOD: f64 = 0.002;

    /// Holds one joint of 3 rad/s, 10 rad/s² and this `jerk` [rad/s³] between −9 and 9 rad, whose command goes on from `before` to `now`
    /// after a change by `step` [rad/s].
    fn hold(sag: &mut Sag, hold: Hold, jerk: f64, before: f64, step: f64, now: f64, position: f64) {
        let limits = Limits {
            joint_velocity: vec![3.0],
            joint_acceleration: vec![10.0],
            joint_deceleration: vec![10.0],
            joint_jerk: vec![jerk],
            linear_speed: 1.0,
            angular_speed: 1.0,
            position: PositionLimits { lower: vec![-9.0], upper: vec![9.0], margin: 0.1 },
        };
        let braking = Braking {
            decelerations: &[10.0],
            jerks: &[jerk],
            steps: &[step],
            period: PERIOD,
            cycle: PERIOD,
            delay: 0.0,
        };
        let joints = Joints { limits: &limits, positions: &[position], before: &[before], braking };
        sag.hold(hold, true, &joints, 0, &[now]);
    }

    /// A joint that is pulled down at `pull` [rad/s] and commanded to stand, for so long \[s\]: where it is then, and what is sent.
    fn stands(pull: f64, seconds: f64, is_held: bool, factor: f64) -> (f64, f64) {
        let (mut sag, mut position) = (Sag::new(1), 0.0);
        for _ in 0..(seconds / PERIOD) as u32 {
            let moved = PERIOD * (factor * sag.trim()[0] - pull);
            position += moved;
            let passed = Duration::from_secs_f64(PERIOD);
            sag.observe([moved].into_iter(), [0.0].into_iter(), passed, 5.0, &[3.0]);
            let what = if is_held { Hold::Driven } else { Hold::Nothing };
            hold(&mut sag, what, f64::INFINITY, 0.0, 0.0, 0.0, position);
        }
        (position, sag.speeds()[0])
    }

    #[test]
    fn a_joint_that_sinks_is_held_where_it_was_to_stand_but_for_what_it_takes_to_see_it() {
        let (position, speed) = stands(0.05, 4.0, true, 1.0);
        assert!((speed - 0.05).abs() < 1e-6, "{speed}");
        // θ_r − θ_m = d/K_I.
        assert!((position + 0.05 / 5.0).abs() < 1e-3, "{position}");
        let (position, speed) = stands(0.05, 4.0, false, 1.0);
        assert!((position + 0.2).abs() < 1e-9 && (speed - 0.05).abs() < 1e-6, "it is seen all the same");
    }

    #[test]
    fn what_is_too_much_for_a_weight_winds_up_nothing() {
        let (_, speed) = stands(2.0, 4.0, true, 0.0);
        assert_eq!(speed, LARGEST * 3.0);
    }

    proptest! {
        #[test]
        fn command_and_trim_together_keep_the_limits(
            jerk in prop_oneof![Just(f64::INFINITY), 50.0..5000.0f64],
            changes in prop::collection::vec((-2.0..2.0f64, -0.6..0.6f64, 1..400u32), 1..12),
        ) {
            let (mut sag, per_cycle) = (Sag::new(1), jerk * PERIOD * PERIOD);
            let (mut command, mut sent) = (Pace::default(), Pace::default());
            for (wanted, speed, cycles) in changes {
                sag.speeds[0] = speed;
                for cycle in 0..cycles {
                    let step = command.towards(wanted, 0.02, per_cycle);
                    let next = Pace { speed: command.speed + step, step };
                    hold(&mut sag, Hold::Driven, jerk, command.speed, command.step, next.speed, 0.0);
                    let now = next.speed + sag.trim()[0];
                    let now = Pace { speed: now, step: now - sent.speed };
                    prop_assert!(now.step.abs() <= 0.02 + 1e-12 && now.speed.abs() <= 3.0, "{cycle}: {sent:?} {now:?}");
                    prop_assert!((now.step - sent.step).abs() <= per_cycle * (1.0 + 1e-9) + 1e-14, "{cycle}: {sent:?} {now:?}");
                    (sent, command) = (now, next);
                }
            }
        }
    }

    #[test]
    fn no_joint_is_taken_past_its_position_limit_nor_held_before_it_was_driven() {
        let mut sag = Sag::new(1);
        sag.speeds[0] = 0.5;
        for (what, position, sent) in [
            (Hold::Standing, 0.0, 0.0),
            (Hold::Driven, 0.0, 0.5),
            (Hold::Standing, 8.98, 0.1),
            (Hold::Standing, 9.01, 0.0),
            (Hold::Nothing, 0.0, 0.0),
        ] {
            (0..1000).for_each(|_| hold(&mut sag, what, f64::INFINITY, 0.0, 0.0, 0.0, position));
            assert!((sag.trim()[0] - sent).abs() < 1e-9, "{position}: {}", sag.trim()[0]);
        }
    }

    #[test]
    fn a_late_robot_is_observed_slowly() {
        assert_eq!(observed_at(5.0, 0.0), 5.0);
        assert_eq!(observed_at(5.0, 0.2), 2.5);
        assert_eq!(observed_at(0.0, 0.01), WATCHED);
    }
}
