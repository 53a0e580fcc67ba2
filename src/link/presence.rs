//! Detects that the robot appeared, was away, or jumped. Requests made before such an event no longer apply to the robot.

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
    /// The event revokes requests made until this time. `None` if no request can be that old.
    pub since: Option<Duration>,
    /// What the robot did.
    pub what: Returned,
}

/// What a robot did that revokes consent.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Returned {
    /// The robot sent its first joint state.
    Came,
    /// The robot was away for this time \[s\].
    WasAway(f64),
    /// A joint jumped: its number (from 1, arm after arm), the distance \[rad, prismatic: m\], and its kind.
    IsElsewhere(usize, f64, JointKind),
}

impl Return {
    /// Returns whether the robot was not present before, so that its speed is unknown.
    pub fn is_of_newcomer(&self) -> bool {
        !matches!(self.what, Returned::IsElsewhere(..))
    }
}

/// Two successive joint states, and the motion that the robot may have made between them.
pub(crate) struct Step<'a> {
    /// When the previous joint state arrived, if there was one.
    pub before: Option<Duration>,
    pub now: Duration,
    /// The positions in the previous joint state \[rad, prismatic: m\].
    pub from: &'a [f64],
    /// The positions in the present joint state \[rad, prismatic: m\].
    pub to: &'a [f64],
    /// The speed limits of the joints [rad/s, prismatic: m/s].
    pub speeds: &'a [f64],
    /// The recently commanded displacements \[rad, prismatic: m\]. If a limit was lowered meanwhile, they may exceed the
    /// displacements that `speeds` allow.
    pub commanded: &'a [f64],
    /// The kinds of the joints.
    pub kinds: &'a [JointKind],
    /// The number of the arm's first joint, counted from 1, arm after arm.
    pub first_joint: usize,
}

impl Step<'_> {
    /// Returns the event if the robot appeared, was away for longer than `timeout`, or moved farther than it can within the time.
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

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    fn step(before: Option<Duration>, now: Duration, to: f64) -> Option<Return> {
        step_of(JointKind::Revolute, before, now, to)
    }

    fn step_of(kind: JointKind, before: Option<Duration>, now: Duration, to: f64) -> Option<Return> {
        let (commanded, kinds) = (&[0.02], &[kind]);
        Step { before, now, from: &[0.0], to: &[to], speeds: &[2.0], commanded, kinds, first_joint: 7 }
            .returned(1000 * MS)
    }

    #[test]
    fn a_robot_that_continues_has_not_returned() {
        assert_eq!(step(Some(5000 * MS), 5002 * MS, 0.1), None);
        assert_eq!(step(Some(5000 * MS), 5500 * MS, 1.0), None);
        assert_eq!(
            step(Some(5000 * MS), 5002 * MS, std::f64::consts::TAU + 0.01),
            None,
            "an encoder that wraps"
        );
    }

    #[test]
    fn a_joint_that_slides_has_no_turns() {
        let jump = std::f64::consts::TAU + 0.01;
        let what = Returned::IsElsewhere(7, jump, JointKind::Prismatic);
        let returned = step_of(JointKind::Prismatic, Some(5000 * MS), 5002 * MS, jump);
        assert_eq!(returned, Some(Return { since: Some(5000 * MS), what }));
    }

    #[test]
    fn a_robot_that_was_away_or_jumped_has_returned() {
        let away = Return { since: Some(8000 * MS), what: Returned::WasAway(4.0) };
        assert_eq!(step(Some(5000 * MS), 9000 * MS, 0.0), Some(away));
        let elsewhere =
            Return { since: Some(5000 * MS), what: Returned::IsElsewhere(7, 1.2, JointKind::Revolute) };
        assert_eq!(step(Some(5000 * MS), 5400 * MS, 1.2), Some(elsewhere));
        assert_eq!(step(None, 9000 * MS, 0.0), Some(Return { since: Some(8000 * MS), what: Returned::Came }));
    }
}
