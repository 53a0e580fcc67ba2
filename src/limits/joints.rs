//! The joints between two commands.

use crate::{Braking, Limits, Pace, Span};

/// The joints between two commands: what the next one is made by.
#[derive(Clone, Copy, Debug)]
pub struct Joints<'a> {
    /// What the commands never exceed.
    pub limits: &'a Limits,
    /// Where the joints are when the next command reaches them \[rad, prismatic: m\].
    pub positions: &'a [f64],
    /// The command before [rad/s, prismatic: m/s].
    pub before: &'a [f64],
    /// What each joint has for braking, and the cycle.
    pub braking: Braking<'a>,
}

impl Joints<'_> {
    /// How the last command has left the joint number `joint`.
    pub(crate) fn pace(&self, joint: usize) -> Pace {
        Pace { speed: self.before[joint], step: self.braking.steps[joint] }
    }

    /// What the joint number `joint` may do in this cycle.
    pub fn span(&self, joint: usize) -> Span {
        Span::of(self, joint)
    }

    /// Makes of the `velocity`, whatever it is, the next one of a stop [rad/s, prismatic: m/s]: each joint slows down from its last command by its
    /// own deceleration, whatever the others do. The tool leaves its path by that.
    pub fn stop(&self, velocity: &mut [f64]) {
        for (joint, speed) in velocity.iter_mut().enumerate() {
            let most = self.braking.decelerations[joint] * self.braking.period;
            *speed = self.pace(joint).stopped(most, self.braking.jerk_step(joint));
        }
    }
}
