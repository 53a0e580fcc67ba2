//! For each joint, the largest limits since the joint last stood. Lower limits do not apply to the motion that is under way.

use crate::Limits;
use serde::{Deserialize, Serialize};

/// For each joint, the largest deceleration limit and the largest jerk limit in force since the joint last stood. A joint that
/// moves relies on these limits for its braking, so a change of parameters must not reduce them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LatchedLimits {
    /// The decelerations [rad/s², prismatic: m/s²].
    decelerations: Vec<f64>,
    /// The jerks [rad/s³, prismatic: m/s³].
    jerks: Vec<f64>,
    /// The last command [rad/s, prismatic: m/s].
    last: Vec<f64>,
    /// The last command less the command before it [rad/s, prismatic: m/s].
    steps: Vec<f64>,
    /// Whether the last command made each joint stand.
    stood: Vec<bool>,
}

impl LatchedLimits {
    /// Creates the limits of joints that stand.
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

    /// Updates the latched limits after `command`, which was sent under `limits` [rad/s, prismatic: m/s]. `hold` is the part of
    /// `command` that keeps the joints still against a payload or gravity. A command makes a joint stand if it equals the joint's
    /// hold. After two such commands in a row, `limits` replace the joint's latched limits.
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

    /// Forgets the earlier limits of joint number `joint`. `command` is its last command [rad/s, prismatic: m/s], and `stands` is
    /// whether the joint stands.
    pub fn begin(&mut self, joint: usize, command: f64, stands: bool) {
        (self.last[joint], self.decelerations[joint], self.jerks[joint]) = (command, 0.0, 0.0);
        self.stood[joint] = stands;
    }

    /// Returns three lists with one number per joint: the decelerations [rad/s², prismatic: m/s²], the jerks [rad/s³, prismatic:
    /// m/s³], and the changes of the speeds by the last command [rad/s, prismatic: m/s].
    pub fn each(&self) -> [&[f64]; 3] {
        [&self.decelerations, &self.jerks, &self.steps]
    }
}
