//! The pull at the joints of an arm that takes velocities, and the hold that balances it.
//!
//! The velocity controller of a joint keeps the joint still only if no torque acts on it. Let τ be a torque of a payload or of
//! gravity that the controller, with the gain k_v, does not compensate for. Then the joint moves slower than its command u by the
//! pull p = τ/k_v, and sinks at that speed if its command is zero. The estimate p̂ follows
//!
//! ```text
//! dp̂/dt = K_I (u − θ̇ − p̂)
//! ```
//!
//! with the speed θ̇ of the joint and the rate K_I of the estimate, which `observed_at` returns.
//!
//! With the parameter `integral`, the command is the desired motion plus the hold, and the hold follows p̂. Then θ̇ follows the
//! desired motion. Until p̂ has reached p, the joint falls behind that motion by p/K_I in total. A limit on the command does not wind
//! up the estimate, because u is the command that was sent.

use dq_limits::{Limits, Pace};
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// The rate at which the estimate follows the [`Pull`] if the servo only estimates the pull and does not balance it [1/s].
const WATCHED: f64 = 5.0;

/// Largest product of the estimate's rate and the robot's delay. It is half of the product that the small-gain theorem allows.
const STABLE: f64 = 0.5;

/// The largest estimate of a joint's pull (see [`Pull`]), as a fraction of the joint's speed limit.
const LARGEST: f64 = 0.2;
/// The largest rate of change of an estimated pull [rad/s², prismatic: m/s²]. A faster change is not due to a weight, but to a
/// joint that stands although it is commanded to move.
const FASTEST_CHANGE: f64 = 1.0;

/// A joint stands if it is slower than this [rad/s, prismatic: m/s].
const STANDSTILL: f64 = 0.01;

/// The speed, or change of speed, from which a motion does not count for the estimate of the [`Pull`] [rad/s, prismatic: m/s].
/// Because an error of the estimated delay looks like a pull in a fast motion, the weight of a motion falls linearly with its speed:
/// from 1 at standstill to 0 at this speed.
const FAST: f64 = 0.1;

/// The largest rate of change of a joint's hold, as a fraction of the joint's acceleration limit. The hold is the part of the
/// command that balances a payload or gravity.
const SHARE: f64 = 0.1;

/// The largest hold toward a position limit, divided by the joint's distance from that limit [1/s]. The hold is the part of the
/// command that balances a payload or gravity.
const OUTWARD: f64 = 5.0;

/// The estimated pull at the joints of one arm: by how much a payload or gravity reduces their speeds below the commands.
#[derive(Serialize, Deserialize)]
pub(crate) struct Pull {
    /// The pull at each joint: the part of the difference between commanded and real speed that a payload or gravity causes [rad/s,
    /// prismatic: m/s].
    speeds: Vec<f64>,
    /// The change of each joint's hold (the part of its command that balances the pull) in the last cycle [rad/s, prismatic: m/s].
    steps: Vec<f64>,
    /// Whether the servo has driven the arm since the arm appeared. Before that, the servo does not balance the pull.
    driven: bool,
    /// The time until which commands have been compared with the joints' motion; `None` if the next comparison starts afresh.
    pub compared: Option<Duration>,
}

/// Whether the servo balances the pull at the joints of an arm. The pull is the speed that a joint loses to a payload or gravity.
#[derive(Clone, Copy)]
pub enum Hold {
    /// The servo does not balance a payload or gravity.
    Nothing,
    /// The servo balances a payload or gravity, and the arm should stand.
    Standing,
    /// The servo balances a payload or gravity, and moves the arm.
    Driven,
}

/// The data that limit the hold, the part of the command that balances the pull. The lists have one number per joint of all arms.
pub(crate) struct Room<'a> {
    pub limits: &'a Limits,
    /// The joint positions \[rad, prismatic: m\].
    pub positions: &'a [f64],
    /// The joints' jerk limits [rad/s³, prismatic: m/s³].
    pub jerks: &'a [f64],
    /// The control period \[s\].
    pub period: f64,
}

/// The motion of one joint between two joint states, and its commands.
pub(crate) struct Observed {
    /// The measured displacement \[rad, prismatic: m\].
    pub moved: f64,
    /// The commanded displacement \[rad, prismatic: m\].
    pub asked: f64,
    /// The difference between the command and the recent mean command [rad/s, prismatic: m/s].
    pub change: f64,
}

/// Returns the rate at which the estimated [`Pull`] follows the real one [1/s]. `integral` is the value of the parameter
/// `integral`, and `delay` is the time after which the robot responds \[s\].
pub(crate) fn observed_at(integral: f64, delay: f64) -> f64 {
    let rate = if integral > 0.0 { integral } else { WATCHED };
    rate.min(STABLE / delay.max(f64::MIN_POSITIVE))
}

impl Pull {
    pub fn new(joint_count: usize) -> Self {
        let zeros = vec![0.0; joint_count];
        Self { speeds: zeros.clone(), steps: zeros, driven: false, compared: None }
    }

    /// Returns the pull at each joint: by how much a payload or gravity reduces the joint's speed below the command [rad/s,
    /// prismatic: m/s].
    pub fn speeds(&self) -> &[f64] {
        &self.speeds
    }

    /// Drops the estimate, because the robot has jumped or may be another robot.
    pub fn forget(&mut self) {
        self.speeds.fill(0.0);
        self.compared = None;
        self.release();
    }

    /// Lets [`balance`](Self::balance) lower the hold of each joint (the part of its command that balances the pull) to 0, until
    /// the servo drives the arm again.
    pub fn release(&mut self) {
        self.driven = false;
    }

    /// Updates the estimate with the motion of `joints` within the time `passed`. `factor` is the fraction of its commanded speed at
    /// which the robot moves, and `rate` is the rate at which the estimate follows the pull [1/s]. `largest` has the joints' speed
    /// limits [rad/s, prismatic: m/s].
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
            // If a joint stands at a steady command, the pull equals the command. If the joint moves slowly, somebody may have
            // told the robot to be slow.
            let stands = moved.abs() <= STANDSTILL * passed;
            let asked_to_move = asked - passed * *speed;
            // If the command is small, the pull alone moves the joint.
            let fastest = asked_to_move.abs().min(asked.abs());
            let fast = if stands { 0.0 } else { fastest / passed.max(f64::MIN_POSITIVE) };
            let slow = (1.0 - fast.max(change.abs()) / FAST).max(0.0);
            let most = FASTEST_CHANGE * passed;
            let gain = slow * rate.min(1.0 / passed.max(f64::MIN_POSITIVE));
            let step = (gain * (factor * asked_to_move - moved)).max(-most).min(most);
            *speed = (*speed + step).max(-LARGEST * largest).min(LARGEST * largest);
        }
    }

    /// Moves the `hold` of each joint [rad/s, prismatic: m/s] toward the estimated pull, or toward 0, within the limits on
    /// acceleration and jerk. `first` is the index of the arm's first joint among all joints. `within` returns the range of each
    /// joint's hold.
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
