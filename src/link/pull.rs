//! What pulls at the joints of an arm that takes velocities, and what holds them against it.
//!
//! A velocity servo stands only if nothing pulls at it. Under a torque τ that it does not know, of a payload or of gravity, a joint moves
//! slower than its command u by the pull p = τ/k_v, and sinks at that speed if zero is commanded. The estimate p̂ follows
//!
//! ```text
//! dp̂/dt = K_I (u − θ̇ − p̂)
//! ```
//!
//! With the parameter `integral`, the command contains p̂ besides the motion: the hold. Then θ̇ follows the motion, and the joint stands where
//! it was stopped, p/K_I below. A limit that keeps u from what was wanted winds up nothing, because u is what was sent.

use dq_limits::{Limits, Pace};
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// The rate of the estimate if nothing is held [1/s].
const WATCHED: f64 = 5.0;

/// The rate times the delay is kept below this: half of what is stable by the small-gain theorem.
const STABLE: f64 = 0.5;

/// The estimate never exceeds this part of a joint's largest speed, and changes by no more than this [rad/s², prismatic: m/s²]: what is
/// faster than that is no weight, but a joint that stands although it is commanded to move.
const LARGEST: f64 = 0.2;
const FASTEST_CHANGE: f64 = 1.0;

/// Slower than this [rad/s, prismatic: m/s] a joint stands.
const STANDSTILL: f64 = 0.01;

/// In fast or changing motion an error of the delay looks like a weight. Up to this speed, or change of it [rad/s, prismatic: m/s], joints are
/// observed ever less, and beyond not at all.
const FAST: f64 = 0.1;

/// The part of a joint's acceleration that its hold may take.
const SHARE: f64 = 0.1;

/// The hold towards a position limit is at most the distance from it times this rate [1/s].
const OUTWARD: f64 = 5.0;

/// What pulls at the joints of one arm.
#[derive(Serialize, Deserialize)]
pub(crate) struct Pull {
    /// How much slower each joint moves than it is commanded [rad/s, prismatic: m/s].
    speeds: Vec<f64>,
    /// What the last cycle changed the hold of each joint by [rad/s, prismatic: m/s].
    steps: Vec<f64>,
    /// The arm was driven since it came: nobody holds an arm that nobody has driven.
    driven: bool,
    /// Until when commands were compared with the motion of the joints.
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

/// How the hold of the joints of all arms may change.
pub(crate) struct Room<'a> {
    pub limits: &'a Limits,
    /// Where the joints are \[rad, prismatic: m\].
    pub positions: &'a [f64],
    /// [rad/s³, prismatic: m/s³].
    pub jerks: &'a [f64],
    /// From one cycle to the next \[s\].
    pub period: f64,
}

/// Where one joint went between two joint states, and what it was commanded.
pub(crate) struct Observed {
    /// How far it went, and how far its commands should have taken it \[rad, prismatic: m\].
    pub moved: f64,
    pub asked: f64,
    /// By how much its command differs from the mean of the last moments [rad/s, prismatic: m/s].
    pub change: f64,
}

/// The rate of the estimate [1/s] for the parameter `integral` and a robot that answers after `delay` \[s\].
pub(crate) fn observed_at(integral: f64, delay: f64) -> f64 {
    let rate = if integral > 0.0 { integral } else { WATCHED };
    rate.min(STABLE / delay.max(f64::MIN_POSITIVE))
}

impl Pull {
    pub fn new(joint_count: usize) -> Self {
        let zeros = vec![0.0; joint_count];
        Self { speeds: zeros.clone(), steps: zeros, driven: false, compared: None }
    }

    /// How much slower than commanded each joint moves [rad/s, prismatic: m/s].
    pub fn speeds(&self) -> &[f64] {
        &self.speeds
    }

    /// Forgets what pulled at another robot, or at this one elsewhere.
    pub fn forget(&mut self) {
        self.speeds.fill(0.0);
        self.compared = None;
        self.release();
    }

    /// Holds nothing until the arm is driven again.
    pub fn release(&mut self) {
        self.driven = false;
    }

    /// Takes what the joints of a robot that moves at the part `factor` of its commanded speed did within `passed`. The estimate follows at `rate` [1/s];
    /// the joints' largest speeds are `largest` [rad/s].
    pub fn observe(
        &mut self,
        joints: impl Iterator<Item = Observed>,
        (passed, factor): (Duration, f64),
        rate: f64,
        largest: &[f64],
    ) {
        let passed = passed.as_secs_f64();
        for ((speed, largest), Observed { moved, asked, change }) in
            self.speeds.iter_mut().zip(largest).zip(joints)
        {
            // A joint that stands at a steady command is pulled at as much as it is commanded; one that moves slowly may be of a robot that was
            // told to be slow.
            let stands = moved.abs() <= STANDSTILL * passed;
            let asked_to_move = asked - passed * *speed;
            let fast = if stands { 0.0 } else { asked_to_move.abs() / passed.max(f64::MIN_POSITIVE) };
            let slow = (1.0 - fast.max(change.abs()) / FAST).max(0.0);
            let most = FASTEST_CHANGE * passed;
            let gain = slow * rate.min(1.0 / passed.max(f64::MIN_POSITIVE));
            let step = (gain * (factor * asked_to_move - moved)).max(-most).min(most);
            *speed = (*speed + step).max(-LARGEST * largest).min(LARGEST * largest);
        }
    }

    /// Moves the `hold` of each joint [rad/s, prismatic: m/s] towards the estimate, or towards 0, within the limits on acceleration and jerk. The arm's
    /// joints begin with the number `first` of all. `within` gives between which values the hold of each may be.
    pub fn balance(
        &mut self,
        what: Hold,
        room: &Room,
        first: usize,
        within: impl Fn(usize) -> (f64, f64),
        hold: &mut [f64],
    ) {
        let Room { limits, positions, jerks, period } = room;
        self.driven |= matches!(what, Hold::Driven);
        let is_held = self.driven && !matches!(what, Hold::Nothing);
        for (index, (hold, last)) in hold.iter_mut().zip(&mut self.steps).enumerate() {
            let joint = first + index;
            let (lowest, highest) = within(index);
            let down = (positions[joint] - limits.position.lower[joint]).max(0.0);
            let up = (limits.position.upper[joint] - positions[joint]).max(0.0);
            let wanted = if is_held { self.speeds[index].max(lowest).min(highest) } else { 0.0 };
            let wanted = wanted.max(-OUTWARD * down).min(OUTWARD * up);
            let faster = SHARE * period * limits.joint_acceleration[joint];
            *last =
                Pace { speed: *hold, step: *last }.towards(wanted, faster, jerks[joint] * period * period);
            *hold += *last;
        }
    }
}
