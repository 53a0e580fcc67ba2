//! Whether the robot is the one, where it is, for which a goal was given.

use super::way;
use crate::arm::JointKind;
use std::time::Duration;

/// Joint states may come this much late after others that were not, without the robot having jumped.
const LATENESS: f64 = 0.05;

/// How far a joint may have gone \[rad, prismatic: m\] at its largest speed [rad/s] between two joint states so many seconds apart.
pub fn longest_way(speed: f64, seconds: f64) -> f64 {
    speed * (seconds + LATENESS)
}

/// Why a goal is not pursued before it is sent again, or the servo is set going by `~/pause` (false).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Rearm {
    /// The robot came this long after the goal \[s\].
    CameLater(f64),
    /// The robot was away for so long \[s\].
    WasAway(f64),
    /// The joint, counted from 1 arm after arm and of that kind, is this far \[rad, prismatic: m\] from where it was a moment before.
    IsElsewhere(usize, f64, JointKind),
    /// Two publishers gave joint states of one arm.
    TwoSources,
    /// The joint, counted from 1 arm after arm and of that kind, is this far \[rad, prismatic: m\] from where it was sent and should be.
    FellBehind(usize, f64, JointKind),
    /// The frame with which the goal moves was lost for so long \[s\].
    FrameWasAway(f64),
    /// The servo was stopped.
    Stopped,
    /// A twist moved the arm.
    Jogged,
    /// Something else is controlled than when the goal was given.
    AnotherAim,
}

impl Rearm {
    /// What happened, for people; `joint` names a joint by its number.
    pub fn explain(&self, joint: impl Fn(usize) -> String) -> String {
        match self {
            Self::CameLater(seconds) => format!("the robot came {seconds:.1} s after the goal"),
            Self::WasAway(seconds) => format!("the robot was away for {seconds:.1} s"),
            Self::IsElsewhere(number, way, kind) => {
                let unit = kind.unit();
                format!("the robot came back elsewhere: {} jumped by {way:.2} {unit}", joint(*number))
            }
            Self::TwoSources => "two publishers gave joint states".to_owned(),
            Self::FellBehind(number, lead, kind) => {
                let unit = kind.unit();
                format!(
                    "{} is {lead:.2} {unit} from where it was sent (following_error): is it blocked?",
                    joint(*number)
                )
            }
            Self::FrameWasAway(seconds) => {
                format!("TF did not say for {seconds:.1} s where the goal's frame is")
            }
            Self::Stopped => "~/stop was called".to_owned(),
            Self::Jogged => "a twist on target_twist came".to_owned(),
            Self::AnotherAim => "something else is controlled".to_owned(),
        }
    }
}

/// The robot is there again: what was asked for before `since` is not asked for any more.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::servo) struct Return {
    pub since: Duration,
    pub why: Rearm,
}

/// What the robot may have done between two joint states.
pub(super) struct Step<'a> {
    /// When the state before came, if there was one.
    pub before: Option<Duration>,
    pub now: Duration,
    /// Positions before and now \[rad, prismatic: m\].
    pub from: &'a [f64],
    pub to: &'a [f64],
    /// The joints' largest speeds [rad/s].
    pub speeds: &'a [f64],
    /// How far they were commanded lately \[rad\]: with limits that have been lowered meanwhile they still do that.
    pub commanded: &'a [f64],
    /// What the joints do.
    pub kinds: &'a [JointKind],
    /// The arm's first joint, counted from 1 arm after arm.
    pub first_joint: usize,
}

impl Step<'_> {
    /// Whether the robot has been away for longer than `timeout`, or has gone farther than it can have in the time.
    pub fn returned(&self, timeout: Duration) -> Option<Return> {
        let lately = self.now.saturating_sub(timeout);
        let Some(before) = self.before else {
            return Some(Return { since: lately, why: Rearm::CameLater(0.0) });
        };
        let away = self.now.saturating_sub(before);
        if away > timeout {
            return Some(Return { since: lately, why: Rearm::WasAway(away.as_secs_f64()) });
        }
        let seconds = away.as_secs_f64();
        let speeds = self.speeds.iter().zip(self.commanded);
        let allowed = speeds.map(|(speed, way)| longest_way(*speed, seconds) + way.abs());
        let mut jumps = self.from.iter().zip(self.to).zip(self.kinds).zip(allowed).enumerate();
        jumps.find_map(|(joint, (((from, to), kind), allowed))| {
            let jump = way(*kind, *from, *to).abs();
            let why = Rearm::IsElsewhere(self.first_joint + joint, jump, *kind);
            (jump > allowed).then_some(Return { since: before, why })
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
    fn a_robot_that_goes_on_has_not_returned() {
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
        let why = Rearm::IsElsewhere(7, jump, JointKind::Prismatic);
        let returned = step_of(JointKind::Prismatic, Some(5000 * MS), 5002 * MS, jump);
        assert_eq!(returned, Some(Return { since: 5000 * MS, why }));
        assert!(why.explain(|joint| joint.to_string()).ends_with("7 jumped by 6.29 m"));
    }

    #[test]
    fn one_that_was_away_or_is_elsewhere_has() {
        let away = Return { since: 8000 * MS, why: Rearm::WasAway(4.0) };
        assert_eq!(step(Some(5000 * MS), 9000 * MS, 0.0), Some(away));
        let elsewhere = Return { since: 5000 * MS, why: Rearm::IsElsewhere(7, 1.2, JointKind::Revolute) };
        assert_eq!(step(Some(5000 * MS), 5400 * MS, 1.2), Some(elsewhere));
        assert_eq!(step(None, 9000 * MS, 0.0), Some(Return { since: 8000 * MS, why: Rearm::CameLater(0.0) }));
    }
}
