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
    /// The last command [rad/s, prismatic: m/s], and what it changed.
    last: Vec<f64>,
    steps: Vec<f64>,
    /// Which joints stood at the last command.
    stood: Vec<bool>,
}

impl LatchedLimits {
    /// Those of joints that stand.
    pub fn new(limits: &Limits) -> Self {
        let zeros = vec![0.0; limits.joint_velocity.len()];
        let mut latched = Self {
            decelerations: zeros.clone(),
            jerks: zeros.clone(),
            last: zeros.clone(),
            steps: zeros.clone(),
            stood: vec![true; zeros.len()],
        };
        latched.update(limits, &zeros, &zeros);
        latched
    }

    /// Adopts `limits` after that `command` [rad/s], of which `hold` moves nothing. A joint that stood for two commands keeps no other limits.
    pub fn update(&mut self, limits: &Limits, command: &[f64], hold: &[f64]) {
        for (joint, (speed, hold)) in command.iter().zip(hold).enumerate() {
            let stands = speed == hold;
            let forgets = std::mem::replace(&mut self.stood[joint], stands) && stands;
            let keep =
                |latched: &mut f64, given: f64| *latched = if forgets { given } else { latched.max(given) };
            keep(&mut self.decelerations[joint], limits.deceleration(joint));
            keep(&mut self.jerks[joint], limits.jerk(joint));
            self.steps[joint] = speed - self.last[joint];
            self.last[joint] = *speed;
        }
    }

    /// Goes on with a joint from that `command` [rad/s], which says nothing of how it came to its speed: it counts on nothing yet.
    pub fn begin(&mut self, joint: usize, command: f64, stands: bool) {
        (self.last[joint], self.decelerations[joint], self.jerks[joint]) = (command, 0.0, 0.0);
        self.stood[joint] = stands;
    }

    /// The decelerations, the jerks [rad/s³], and what the last command has changed [rad/s], one number a joint each.
    pub fn each(&self) -> [&[f64]; 3] {
        [&self.decelerations, &self.jerks, &self.steps]
    }
}
