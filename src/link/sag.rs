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
pub(crate) struct Sag {
    /// How much slower each joint goes than it is commanded [rad/s, prismatic: m/s].
    speeds: Vec<f64>,
    /// What each is sent besides.
    trim: Vec<f64>,
    /// Whether the arm was driven since it came, or since it last did not obey: what nobody has driven is held by nobody.
    driven: bool,
    /// Until when commands were compared with what the joints did; none where nothing was yet.
    pub compared: Option<Duration>,
}

/// What a joint may do besides its command in a cycle.
pub(crate) struct Room<'a> {
    /// Its largest speeds [rad/s], accelerations [rad/s²].
    pub limits: [&'a [f64]; 2],
    /// The commands of the cycle before and of this one [rad/s].
    pub commands: [&'a [f64]; 2],
    /// Where they are, and their lowest and highest positions \[rad\].
    pub positions: [&'a [f64]; 3],
    /// The cycle \[s\].
    pub period: f64,
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
        Self { speeds: vec![0.0; joint_count], trim: vec![0.0; joint_count], driven: false, compared: None }
    }

    /// Nothing is known of a robot that has come, or that does not obey.
    pub fn forget(&mut self) {
        self.speeds.fill(0.0);
        self.trim.fill(0.0);
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

    /// Brings what is sent besides the commands nearer to what it should be, or to 0, within the limits that the commands leave; `seen` says
    /// whether the arm was seen to follow.
    pub fn hold(&mut self, hold: Hold, seen: bool, room: &Room) {
        let ([speeds, accelerations], [before, now]) = (room.limits, room.commands);
        self.driven |= matches!(hold, Hold::Driven);
        let is_held = self.driven && !matches!(hold, Hold::Nothing);
        for (joint, trim) in self.trim.iter_mut().enumerate() {
            let most = if seen { f64::INFINITY } else { UNSEEN };
            let wanted = if is_held { self.speeds[joint].max(-most).min(most) } else { 0.0 };
            let step = room.period * accelerations[joint];
            let commanded = now[joint] - before[joint];
            let (lower, upper) = ((-step - commanded).min(0.0), (step - commanded).max(0.0));
            let step = (wanted - *trim).max(-SHARE * step).min(SHARE * step);
            let next = *trim + step.max(lower).min(upper);
            // It takes no command out of the limits; one that is outside, as they were lowered, is brought inside by the envelope.
            let (lower, upper) =
                ((-speeds[joint] - now[joint]).min(0.0), (speeds[joint] - now[joint]).max(0.0));
            let [position, lowest, highest] = room.positions.map(|list| list[joint]);
            let (down, up) = ((position - lowest).max(0.0), (highest - position).max(0.0));
            *trim = next.max(lower.max(-OUTWARD * down)).min(upper.min(OUTWARD * up));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD: f64 = 0.002;

    fn room<'a>(before: &'a [f64], now: &'a [f64], position: &'a [f64]) -> Room<'a> {
        Room {
            limits: [&[3.0], &[10.0]],
            commands: [before, now],
            positions: [position, &[-9.0], &[9.0]],
            period: PERIOD,
        }
    }

    /// A joint that is pulled down at `pull` [rad/s] and commanded to stand, for so long \[s\]: where it is then, and what is sent.
    fn stands(pull: f64, seconds: f64, is_held: bool, factor: f64) -> (f64, f64) {
        let (mut sag, mut position) = (Sag::new(1), 0.0);
        for _ in 0..(seconds / PERIOD) as u32 {
            let moved = PERIOD * (factor * sag.trim()[0] - pull);
            position += moved;
            let passed = Duration::from_secs_f64(PERIOD);
            sag.observe([moved].into_iter(), [0.0].into_iter(), passed, 5.0, &[3.0]);
            let hold = if is_held { Hold::Driven } else { Hold::Nothing };
            sag.hold(hold, true, &room(&[0.0], &[0.0], &[position]));
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

    #[test]
    fn command_and_trim_together_keep_the_limits() {
        let mut sag = Sag::new(1);
        sag.speeds[0] = 0.5;
        let (mut sent, mut command) = (0.0, 0.0_f64);
        for cycle in 0..2000 {
            let next = if cycle < 1000 { (command + 0.02).min(3.0) } else { (command - 0.02).max(-3.0) };
            sag.hold(Hold::Driven, true, &room(&[command], &[next], &[0.0]));
            let now = next + sag.trim()[0];
            assert!((now - sent).abs() <= 0.02 + 1e-12 && now.abs() <= 3.0, "{cycle}: {sent} {now}");
            (sent, command) = (now, next);
        }
    }

    #[test]
    fn no_joint_is_taken_past_its_position_limit_nor_held_before_it_was_driven() {
        let mut sag = Sag::new(1);
        sag.speeds[0] = 0.5;
        for (hold, position, sent) in [
            (Hold::Standing, 0.0, 0.0),
            (Hold::Driven, 0.0, 0.5),
            (Hold::Standing, 8.98, 0.1),
            (Hold::Standing, 9.01, 0.0),
            (Hold::Nothing, 0.0, 0.0),
        ] {
            (0..1000).for_each(|_| sag.hold(hold, true, &room(&[0.0], &[0.0], &[position])));
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
