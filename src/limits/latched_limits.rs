//! What a joint counted on when it set off.

use crate::Limits;
use serde::{Deserialize, Serialize};

/// The limits on deceleration and jerk that each joint keeps: what the parameters say, but never less than they have said since it last stood.
/// What a joint counted on when it set off, before a position limit or for a stop, no change of parameters takes from it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LatchedLimits {
    /// [rad/s², prismatic: m/s²].
    decelerations: Vec<f64>,
    /// [rad/s³, prismatic: m/s³].
    jerks: Vec<f64>,
    /// The last command [rad/s, prismatic: m/s], and what it has changed.
    last: Vec<f64>,
    steps: Vec<f64>,
}

impl LatchedLimits {
    /// Those of joints that stand.
    pub fn new(limits: &Limits) -> Self {
        let zeros = vec![0.0; limits.joint_velocity.len()];
        let (decelerations, jerks, last, steps) = (zeros.clone(), zeros.clone(), zeros.clone(), zeros);
        let mut latched = Self { decelerations, jerks, last: last.clone(), steps };
        latched.update(limits, &last);
        latched
    }

    /// Goes on to `limits` after that `command` [rad/s]. A joint that has stood for a cycle forgets.
    pub fn update(&mut self, limits: &Limits, command: &[f64]) {
        for (joint, speed) in command.iter().enumerate() {
            let stands = *speed == 0.0 && self.last[joint] == 0.0;
            let keep =
                |latched: &mut f64, given: f64| *latched = if stands { given } else { latched.max(given) };
            keep(&mut self.decelerations[joint], limits.deceleration(joint));
            keep(&mut self.jerks[joint], limits.jerk(joint));
            self.steps[joint] = speed - self.last[joint];
            self.last[joint] = *speed;
        }
    }

    /// Goes on with a joint from that `speed` [rad/s], which nobody knows how it came to: it counts on nothing yet.
    pub fn begin(&mut self, joint: usize, speed: f64) {
        (self.last[joint], self.decelerations[joint], self.jerks[joint]) = (speed, 0.0, 0.0);
    }

    /// The decelerations, the jerks [rad/s³], and what the last command has changed [rad/s], one number a joint each.
    pub fn each(&self) -> [&[f64]; 3] {
        [&self.decelerations, &self.jerks, &self.steps]
    }
}
