//! How joints come to rest.

use super::Limits;

/// The deceleration of each joint in force [rad/s²]: what its limits say, but never less than they have said since it last stood.
/// What a joint counted on when it set off, before a position limit or for a stop, no change of parameters takes from it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Decelerations(Vec<f64>);

impl Decelerations {
    /// Those of joints that stand.
    pub fn new(limits: &Limits) -> Self {
        Self((0..limits.joint_velocity.len()).map(|joint| limits.deceleration(joint)).collect())
    }

    /// Goes on to `limits` after the commands `before` and `now` [rad/s]: a joint that stands or has turned round forgets.
    pub fn update(&mut self, limits: &Limits, before: &[f64], now: &[f64]) {
        for (joint, held) in self.0.iter_mut().enumerate() {
            let stood = now[joint] == 0.0 || before[joint] * now[joint] < 0.0;
            let given = limits.deceleration(joint);
            *held = if stood { given } else { held.max(given) };
        }
    }

    /// One a joint.
    pub fn each(&self) -> &[f64] {
        &self.0
    }

    /// A cycle of `period` \[s\] of a stop: each joint slows down by its own deceleration, whatever the others do. The tool leaves
    /// its path by that.
    pub fn stop(&self, command: &mut [f64], period: f64) {
        for (speed, deceleration) in command.iter_mut().zip(&self.0) {
            *speed = slowed(*speed, 0.0, deceleration * period);
        }
    }
}

/// `speed` slowed down to `wanted`, which lies between 0 and it, by no more than `most`.
pub(super) fn slowed(speed: f64, wanted: f64, most: f64) -> f64 {
    let change = wanted - speed;
    if change.abs() <= most { wanted } else { speed + most.copysign(change) }
}
