//! How joints come to rest.

use super::{Filter, Given};
use crate::servo::Limits;

/// The limits on deceleration and jerk that each joint keeps: what the parameters say, but never less than they have said since it last stood.
/// What a joint counted on when it set off, before a position limit or for a stop, no change of parameters takes from it.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::servo) struct HeldLimits {
    /// [rad/s², prismatic: m/s²].
    decelerations: Vec<f64>,
    /// What the parameters said when the last command was made, which counted on it [rad/s², prismatic: m/s²].
    counted_on: Vec<f64>,
    /// [rad/s³, prismatic: m/s³].
    jerks: Vec<f64>,
    /// The last command [rad/s, prismatic: m/s], and what it has changed.
    last: Vec<f64>,
    steps: Vec<f64>,
}

impl HeldLimits {
    /// Those of joints that stand.
    pub fn new(limits: &Limits) -> Self {
        let count = limits.joint_velocity.len();
        let decelerations: Vec<_> = (0..count).map(|joint| limits.deceleration(joint)).collect();
        Self {
            counted_on: decelerations.clone(),
            decelerations,
            jerks: (0..count).map(|joint| limits.jerk(joint)).collect(),
            last: vec![0.0; count],
            steps: vec![0.0; count],
        }
    }

    /// Goes on to `limits` after that `command` [rad/s]: a joint that stands or has turned round forgets.
    pub fn update(&mut self, limits: &Limits, command: &[f64]) {
        for (joint, (held, last)) in self.decelerations.iter_mut().zip(&mut self.last).enumerate() {
            self.steps[joint] = command[joint] - *last;
            let (stands, jerk) = (command[joint] == 0.0 && *last == 0.0, limits.jerk(joint));
            self.jerks[joint] = if stands { jerk } else { self.jerks[joint].max(jerk) };
            let given = limits.deceleration(joint);
            let counted_on = std::mem::replace(&mut self.counted_on[joint], given);
            let has = if *last * command[joint] < 0.0 { counted_on } else { *held };
            *held = if command[joint] == 0.0 { given } else { given.max(has) };
            *last = command[joint];
        }
    }

    /// Goes on from that `command` [rad/s], which nobody knows how the arm came to.
    pub fn begin(&mut self, command: &[f64]) {
        self.last.copy_from_slice(command);
    }

    /// The decelerations, the jerks [rad/s³], and what the last command has changed [rad/s], one number a joint each.
    pub fn each(&self) -> [&[f64]; 3] {
        [&self.decelerations, &self.jerks, &self.steps]
    }
}

/// Slows each joint down from its last command by its own deceleration, whatever the others do. The tool leaves its path by that.
pub(super) struct Stop;

impl Filter for Stop {
    fn apply(&mut self, given: &Given, velocity: &mut [f64]) {
        for (joint, speed) in velocity.iter_mut().enumerate() {
            let most = given.braking.decelerations[joint] * given.period;
            let pace = given.pace(joint);
            *speed = pace.speed + pace.towards(0.0, most, given.braking.jerk_step(joint));
        }
    }
}

/// `speed` slowed down to `wanted`, which lies between 0 and it, by no more than `most`.
pub(super) fn slowed(speed: f64, wanted: f64, most: f64) -> f64 {
    let change = wanted - speed;
    if change.abs() <= most { wanted } else { speed + most.copysign(change) }
}
