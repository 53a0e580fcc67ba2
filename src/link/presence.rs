//! Detects that the robot appeared, came back after a silence, or jumped. Requests made before such an event no longer apply to the
//! robot.

use dq_kinematics::arm::JointKind;
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// A joint state may arrive this much later than expected \[s\]. The motion of the joint in this time does not count as a jump.
const LATENESS: f64 = 0.05;

/// Returns the longest plausible travel of a joint between two joint states that are `seconds` apart \[rad, prismatic: m\]. `speed`
/// is the joint's speed limit [rad/s, prismatic: m/s].
pub fn longest_travel(speed: f64, seconds: f64) -> f64 {
    speed * (seconds + LATENESS)
}

/// An event that revokes earlier requests: the robot appeared, came back, or jumped.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Return {
    /// The event revokes requests made until this time. `None` if this time would be before the clock began: the event then revokes
    /// nothing.
    pub since: Option<Duration>,
    /// What the robot did.
    pub what: Returned,
}

/// What a robot did that revokes consent.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Returned {
    /// The robot sent its first joint state.
    Came,
    /// The robot sent no joint states for this time \[s\].
    WasAway(f64),
    /// A joint jumped: its number (from 1, arm after arm), the distance \[rad, prismatic: m\], and its kind.
    IsElsewhere(usize, f64, JointKind),
}

impl Return {
    /// Returns whether the robot appeared or came back, so that its speed is unknown.
    pub fn is_of_newcomer(&self) -> bool {
        !matches!(self.what, Returned::IsElsewhere(..))
    }
}

/// Two successive joint states, and the data that limit the plausible motion between them.
pub(crate) struct Step<'a> {
    /// When the previous joint state arrived; `None` if there was no previous one.
    pub before: Option<Duration>,
    pub now: Duration,
    /// The positions in the previous joint state \[rad, prismatic: m\].
    pub from: &'a [f64],
    /// The positions in the present joint state \[rad, prismatic: m\].
    pub to: &'a [f64],
    /// The speed limits of the joints [rad/s, prismatic: m/s].
    pub speeds: &'a [f64],
    /// The displacement that was recently commanded to each joint \[rad, prismatic: m\]. A motion is plausible up to this distance
    /// plus the distance at the speed limit in `speeds`. The speed limit alone is not enough, because it may have been lowered after
    /// these commands.
    pub commanded: &'a [f64],
    /// The kinds of the joints.
    pub kinds: &'a [JointKind],
    /// The number of the arm's first joint, counted from 1, arm after arm.
    pub first_joint: usize,
}

impl Step<'_> {
    /// Returns the [`Return`] event if the robot appeared, was silent for longer than `timeout`, or jumped. It jumped if a joint moved
    /// farther than is plausible between the two joint states. Returns `None` if there is no such event.
    pub fn returned(&self, timeout: Duration) -> Option<Return> {
        // Before the clock began there was no request that could be revoked.
        let lately = self.now.checked_sub(timeout);
        let Some(before) = self.before else {
            return Some(Return { since: lately, what: Returned::Came });
        };
        let away = self.now.saturating_sub(before);
        if away > timeout {
            return Some(Return { since: lately, what: Returned::WasAway(away.as_secs_f64()) });
        }
        let seconds = away.as_secs_f64();
        let speeds = self.speeds.iter().zip(self.commanded);
        let allowed = speeds.map(|(speed, commanded)| longest_travel(*speed, seconds) + commanded.abs());
        let mut jumps = self.from.iter().zip(self.to).zip(self.kinds).zip(allowed).enumerate();
        jumps.find_map(|(joint, (((from, to), kind), allowed))| {
            let jump = kind.displacement(*from, *to).abs();
            let what = Returned::IsElsewhere(self.first_joint + joint, jump, *kind);
            (jump > allowed).then_some(Return { since: Some(before), what })
        })
    }
}
