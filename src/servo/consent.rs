//! Consent: the arm moves if and only if somebody asked for it later than everything that revoked it.
//!
//! Whoever asks for motion gives a consent, dated by when it was sent:
//!
//! | who asks | when that was sent |
//! |---|---|
//! | a goal | when its publisher sent it |
//! | a twist | when its publisher pushed the stick: its first twist that is not zero after a zero, or after a silence of `rearm_timeout` |
//! | `~/pause` (false) | when the servo took it; it asks for the goal in force once more |
//! | `~/reconfigure` | as the goal in force, at which the arm has stalled: it lets the arm go there by another configuration that was found before it was sent |
//!
//! Each [`Revocation`] revokes what was sent up to a time:
//!
//! | what revokes | what was sent until then |
//! |---|---|
//! | `~/stop` | now |
//! | another arms, another tool | now; what came with it may have been sent after it |
//! | the robot was away, or came | `rearm_timeout` before it came |
//! | the robot is elsewhere | the joint state before |
//! | two publishers of joint states, of twists or of commands | now, as long as there are two |
//! | an arm that takes positions fell behind | now |
//! | the arm ceased to follow for the third time in 10 s | now |
//! | the goal's frame was away, or moves with the tool | the consent in force |
//!
//! Besides, `~/pause` (true) holds the arm until `~/pause` (false), and a stop until the arm stands.

use crate::arm::JointKind;
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// Who sent a message, and how long before it came.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Sent {
    /// Its publisher: a number for each.
    pub by: u32,
    /// How long it was under way, where that is known.
    pub ago: Duration,
}

/// Who asks for motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Asker {
    /// The publisher of that number, by a goal.
    Goal(u32),
    /// The publisher of that number, by a twist.
    Twist(u32),
    /// A client of `~/pause`.
    Resume,
}

/// What two publishers give at the same time, of which there may be one only.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Contended {
    /// Joint states of the arm of that number.
    JointStates(usize),
    /// Twists.
    Twists,
    /// Commands to the arm of that number.
    Commands(usize),
}

/// Two publishers of what may have one only.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rivals {
    /// What they publish.
    pub of: Contended,
    /// The number of the publisher that was there first.
    pub first: u32,
    /// The number of the other one.
    pub second: u32,
}

/// What revokes a consent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Revocation {
    /// The robot came this long after the consent \[s\].
    CameLater(f64),
    /// The robot was away for so long \[s\].
    WasAway(f64),
    /// The joint, counted from 1 arm after arm and of that kind, is this far \[rad, prismatic: m\] from where it was a moment before.
    IsElsewhere(usize, f64, JointKind),
    /// There were two publishers.
    Rivals(Contended),
    /// The joint, counted from 1 arm after arm and of that kind, is this far \[rad, prismatic: m\] from where it was sent and should be.
    FellBehind(usize, f64, JointKind),
    /// The arm of that number ceased to follow again and again.
    KeepsLosing(usize),
    /// The frame with which the goal moves was lost for so long \[s\].
    FrameWasAway(f64),
    /// The goal's frame moves with the tool.
    MovesWithTool,
    /// The servo was stopped.
    Stopped,
    /// A twist moved the arm; it revokes goals only.
    Jogged,
    /// Something else is controlled than when it was given.
    AnotherAim,
    /// The tool is another.
    AnotherTool,
}

impl Revocation {
    /// What happened, for people; `joint` names a joint by its number.
    pub fn explain(&self, joint: impl Fn(usize) -> String) -> String {
        match self {
            Self::CameLater(seconds) => format!("the robot came {seconds:.1} s after it was asked to move"),
            Self::WasAway(seconds) => format!("the robot was away for {seconds:.1} s"),
            Self::IsElsewhere(number, way, kind) => {
                let unit = kind.unit();
                format!("the robot came back elsewhere: {} jumped by {way:.2} {unit}", joint(*number))
            }
            Self::Rivals(Contended::JointStates(_)) => "two publishers gave joint states".to_owned(),
            Self::Rivals(Contended::Twists) => "two publishers sent twists".to_owned(),
            Self::Rivals(Contended::Commands(_)) => "another publisher sent commands to the arm".to_owned(),
            Self::FellBehind(number, lead, kind) => {
                let unit = kind.unit();
                format!(
                    "{} is {lead:.2} {unit} from where it was sent (following_error): is it blocked?",
                    joint(*number)
                )
            }
            Self::KeepsLosing(_) => {
                "the arm ceased to follow three times within 10 s: is each joint wired to its own motor, in its own direction?"
                    .to_owned()
            }
            Self::FrameWasAway(seconds) => {
                format!("TF did not say for {seconds:.1} s where the goal's frame is")
            }
            Self::MovesWithTool => {
                "the goal's frame moves with the tool, so that the arm can never reach it".to_owned()
            }
            Self::Stopped => "~/stop was called".to_owned(),
            Self::Jogged => "a twist on target_twist came".to_owned(),
            Self::AnotherAim => "something else is controlled".to_owned(),
            Self::AnotherTool => "tool_offset was changed".to_owned(),
        }
    }

    /// The revocation in one word, as `~/status` has it.
    pub fn name(&self) -> &'static str {
        match self {
            Self::CameLater(_) => "robot_came",
            Self::WasAway(_) => "robot_was_away",
            Self::IsElsewhere(..) => "robot_jumped",
            Self::Rivals(_) => "two_publishers",
            Self::FellBehind(..) => "fell_behind",
            Self::KeepsLosing(_) => "not_following",
            Self::FrameWasAway(_) => "frame_was_away",
            Self::MovesWithTool => "moves_with_tool",
            Self::Stopped => "stop",
            Self::Jogged => "twist",
            Self::AnotherAim => "another_task",
            Self::AnotherTool => "another_tool",
        }
    }
}

/// A consent that was given, and what has become of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Asked {
    /// Who gave it.
    pub by: Asker,
    /// When it was sent.
    pub sent: Duration,
    /// What has revoked it since, if anything has.
    pub revoked: Option<Revocation>,
}

/// The latest revocation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Revoked {
    /// What was sent until then is revoked.
    pub until: Duration,
    /// When it happened.
    pub at: Duration,
    /// What happened.
    pub why: Revocation,
}

/// Whether the arm may move: who asked for it last, and what has revoked that. Times are of the cycle's clock.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Consent {
    asked: Option<Asked>,
    revoked: Option<Revoked>,
    /// When a twist last moved the arm, which supersedes goals that were sent before.
    jogged: Option<Duration>,
    paused: bool,
    stopping: bool,
}

impl Consent {
    /// Who asked last; none where nobody does any more.
    pub fn asked(&self) -> Option<&Asked> {
        self.asked.as_ref()
    }

    /// What revoked last.
    pub fn last_revocation(&self) -> Option<&Revoked> {
        self.revoked.as_ref()
    }

    /// Whether the servo is paused.
    pub fn is_paused(&self) -> bool {
        self.paused
    }

    /// Whether a stop has not brought the arm to rest yet.
    pub fn is_stopping(&self) -> bool {
        self.stopping
    }

    /// Whether the arm may move.
    pub fn is_given(&self) -> bool {
        self.asked.is_some_and(|asked| asked.revoked.is_none()) && !self.paused && !self.stopping
    }

    /// What has revoked the consent in force.
    pub fn revocation(&self) -> Option<Revocation> {
        self.asked.and_then(|asked| asked.revoked)
    }

    /// What supersedes a goal that was `sent` then. Of things at one time the later one to come is the later one.
    pub fn supersedes(&self, sent: Duration) -> Option<Revocation> {
        let jogged = self.jogged.filter(|jogged| sent <= *jogged).map(|_| Revocation::Jogged);
        jogged.or(self.revoked.filter(|revoked| sent < revoked.until).map(|it| it.why_of(sent)))
    }

    /// A goal asks for motion that nothing [`supersedes`](Self::supersedes). One that has waited for its frame says nothing newer than
    /// what was said since.
    pub(crate) fn ask_by_goal(&mut self, by: u32, sent: Duration) {
        let newest = self.asked.filter(|asked| asked.revoked.is_none() && asked.sent > sent);
        let sent = newest.map_or(sent, |asked| asked.sent);
        self.asked = Some(Asked { by: Asker::Goal(by), sent, revoked: None });
    }

    /// A stick that its publisher pushed at `pushed`, and still holds at `now`, asks for motion; the same push asks once.
    pub(super) fn ask_by_twist(&mut self, by: u32, pushed: Duration, now: Duration) {
        let asked = Asked { by: Asker::Twist(by), sent: pushed, revoked: None };
        let is_same = |before: Asked| (before.by, before.sent) == (asked.by, asked.sent);
        if !self.asked.is_some_and(is_same) {
            let revoked = self.revoked.filter(|revoked| pushed <= revoked.until);
            self.asked = Some(Asked { revoked: revoked.map(|it| it.why_of(pushed)), ..asked });
        }
        self.jogged = Some(now);
    }

    /// Ends a pause, and asks once more for the goal in force, if there is one; true where that had been revoked.
    pub(super) fn resume(&mut self, now: Duration) -> bool {
        self.paused = false;
        let Some(asked) = self.asked.filter(|asked| !matches!(asked.by, Asker::Twist(_))) else {
            return false;
        };
        self.asked = Some(Asked { by: Asker::Resume, sent: now, revoked: None });
        asked.revoked.is_some()
    }

    /// Holds the arm until [`resume`](Self::resume).
    pub(super) fn pause(&mut self) {
        self.paused = true;
    }

    /// Revokes what was sent until `now`. The first thing that revoked a consent is the reason.
    pub(crate) fn revoke(&mut self, now: Duration, why: Revocation) {
        self.revoke_present(now, why);
        self.revoke_before(now, now, why);
    }

    /// Revokes at `now` what was sent before `until`.
    pub(super) fn revoke_before(&mut self, until: Duration, now: Duration, why: Revocation) {
        let revoked = Revoked { until, at: now, why };
        if let Some(asked) = self.asked.as_mut().filter(|asked| asked.sent < until) {
            asked.revoked.get_or_insert(revoked.why_of(asked.sent));
        }
        if self.revoked.is_none_or(|before| before.until <= until) {
            self.revoked = Some(revoked);
        }
    }

    /// Revokes the consent in force, and what was sent before it.
    pub(super) fn revoke_present(&mut self, now: Duration, why: Revocation) {
        if let Some(asked) = &mut self.asked {
            asked.revoked.get_or_insert(why);
            let sent = asked.sent;
            self.revoke_before(sent, now, why);
        }
    }

    /// Stops the arm: what was sent until now is revoked, nobody asks any more, and nothing moves it before it stands.
    pub(super) fn stop(&mut self, now: Duration) {
        self.revoke(now, Revocation::Stopped);
        self.stopping = true;
        // A stick that is held asks on, in vain.
        self.asked = self.asked.filter(|asked| matches!(asked.by, Asker::Twist(_)));
    }

    /// The arm stands.
    pub(super) fn stand(&mut self) {
        self.stopping = false;
    }

    /// The consent that a recorded servo had, which was sent then.
    pub(super) fn hold(&mut self, by: Asker, sent: Duration, revoked: bool) {
        self.asked = Some(Asked { by, sent, revoked: None });
        if revoked {
            self.revoke_present(sent, Revocation::Stopped);
        }
    }

    /// Nobody asks any more.
    pub(super) fn withdraw(&mut self) {
        self.asked = None;
    }
}

impl Revoked {
    /// What happened to a consent that was `sent` then.
    fn why_of(&self, sent: Duration) -> Revocation {
        match self.why {
            Revocation::CameLater(_) => Revocation::CameLater(self.at.saturating_sub(sent).as_secs_f64()),
            why => why,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    #[test]
    fn a_goal_is_good_only_where_it_was_sent_after_what_revokes() {
        let mut consent = Consent::default();
        assert!(!consent.is_given(), "nobody has asked");
        consent.ask_by_goal(0, 10 * MS);
        assert!(consent.is_given());
        consent.revoke_before(10 * MS, 20 * MS, Revocation::WasAway(1.0));
        assert!(consent.is_given(), "it was sent later");
        consent.revoke_before(11 * MS, 20 * MS, Revocation::CameLater(0.0));
        assert_eq!(consent.revocation(), Some(Revocation::CameLater(0.01)));
        assert_eq!(consent.supersedes(10 * MS), Some(Revocation::CameLater(0.01)));
        assert_eq!(consent.supersedes(11 * MS), None);
        consent.ask_by_goal(0, 30 * MS);
        consent.revoke(30 * MS, Revocation::AnotherTool);
        assert_eq!(consent.revocation(), Some(Revocation::AnotherTool), "what comes later revokes");
    }

    #[test]
    fn a_stop_ends_what_was_asked_and_a_pause_holds_what_is_asked() {
        let mut consent = Consent::default();
        consent.ask_by_goal(0, 10 * MS);
        consent.pause();
        assert!(!consent.is_given());
        consent.ask_by_goal(0, 12 * MS);
        assert!(!consent.is_given(), "a goal ends no pause");
        assert!(!consent.resume(13 * MS) && consent.is_given());
        consent.stop(20 * MS);
        assert!(consent.asked().is_none() && consent.supersedes(19 * MS) == Some(Revocation::Stopped));
        consent.ask_by_goal(0, 21 * MS);
        assert!(!consent.is_given(), "it has not come to rest");
        consent.stand();
        assert!(consent.is_given());
    }

    #[test]
    fn a_stick_that_is_held_asks_once() {
        let mut consent = Consent::default();
        consent.ask_by_twist(3, 10 * MS, 10 * MS);
        consent.stop(50 * MS);
        consent.stand();
        consent.ask_by_twist(3, 10 * MS, 60 * MS);
        assert_eq!(consent.revocation(), Some(Revocation::Stopped));
        consent.ask_by_twist(4, 20 * MS, 61 * MS);
        consent.ask_by_twist(3, 10 * MS, 62 * MS);
        assert_eq!(consent.revocation(), Some(Revocation::Stopped), "another one asked in between");
        assert!(!consent.resume(70 * MS) && !consent.is_given(), "~/pause (false) releases no stick");
        consent.ask_by_twist(3, 80 * MS, 80 * MS);
        assert!(consent.is_given());
        assert_eq!(consent.supersedes(79 * MS), Some(Revocation::Jogged));
    }

    #[test]
    fn a_goal_that_was_revoked_is_asked_for_once_more_by_the_end_of_a_pause() {
        let mut consent = Consent::default();
        consent.ask_by_goal(0, 10 * MS);
        consent.revoke_present(20 * MS, Revocation::FrameWasAway(2.0));
        assert_eq!((consent.is_given(), consent.supersedes(11 * MS)), (false, None));
        assert!(consent.resume(30 * MS) && consent.is_given());
        assert_eq!(consent.asked().map(|asked| asked.by), Some(Asker::Resume));
        assert!(!Consent::default().resume(30 * MS), "there is no goal");
    }
}
