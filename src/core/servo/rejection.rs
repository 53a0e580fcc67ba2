//! Why a message, or settings, were not taken.

use super::{NoWayRound, Reach, Revocation, SettingsError};
use dq_algebra::NotUnit;
use dq_common::text::cut;
use dq_kinematics::arm::bounds::NumberError;
use dq_link::StateError;
use dq_space::frames::FrameError;
use std::time::Duration;
use thiserror::Error;

/// A message, or settings, that the servo rejected; the last good ones stay in force.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum Rejection {
    /// A number that cannot be meant.
    #[error(transparent)]
    Number(#[from] NumberError),
    /// The quaternion's norm is too far from 1 to be rounding.
    #[error(transparent)]
    NotUnit(#[from] NotUnit),
    /// The goal is in a frame that the servo does not know.
    #[error("frame_id is {got:?}: expected {} or an empty one", expected.iter().map(|frame| format!("{frame:?}")).collect::<Vec<_>>().join(", "))]
    UnknownFrame {
        /// The frame of the goal or twist.
        got: String,
        /// The frames that the servo knows.
        expected: Vec<String>,
    },
    /// The goal is in a frame whose place TF does not say.
    #[error("frame_id is {got:?}, not {expected:?}, and {why}")]
    NoTransform {
        /// The frame of the goal.
        got: String,
        /// The base frame.
        expected: String,
        /// Why it does not.
        why: FrameError,
    },
    /// A goal or twist that was under way for too long, or since before the servo was there.
    #[error("it was sent {:.1} s before it came, by its sender's clock: send it again", .0.as_secs_f64())]
    Late(Duration),
    /// A goal that the arm cannot reach.
    #[error(
        "the goal is {:.3} m away, and the arm reaches {:.3} m (with goal_beyond_reach approach the arm goes as near as it can)",
        .0.goal, .0.longest
    )]
    BeyondReach(Reach),
    /// A goal that came while a twist rules.
    #[error("a twist on target_twist rules: goals are taken again when it has ceased")]
    Jogging,
    /// A goal that was sent before something revoked it, or of a publisher that has sent goals on since.
    #[error("after its publisher began to send {}: let it send nothing for 1.5 s, and then send the goal again", .0.explain(|joint| format!("joint {joint}")))]
    Superseded(Revocation),
    /// A request to go on that was sent before something revoked what it asks for.
    #[error("after it was sent {}: ask again if the arm may go on", .0.explain(|joint| format!("joint {joint}")))]
    Overtaken(Revocation),
    /// A request to go on to a goal of a stream that was revoked and has not paused since: the arm would go to that goal while later ones
    /// are rejected.
    #[error("goals are sent on since {}: let their publisher send nothing for 1.5 s, and then ask again", .0.explain(|joint| format!("joint {joint}")))]
    StreamsOn(Revocation),
    /// Nobody can go to another configuration.
    #[error(transparent)]
    NoWayRound(#[from] NoWayRound),
    /// Settings that cannot be the servo's.
    #[error("settings are not taken: {0}")]
    Settings(#[from] SettingsError),
    /// A joint state of an arm that the servo does not have.
    #[error("a joint state of the arm number {arm}, expected a number below {arms}")]
    UnknownArm {
        /// The number of the arm, counted from 0.
        arm: usize,
        /// How many arms there are.
        arms: usize,
    },
    /// What is no joint state of the arm.
    #[error(transparent)]
    State(#[from] StateError),
    /// Positions or velocities that are not one a joint.
    #[error("the joint state has {got} numbers, expected {expected}: one a joint, arm after arm")]
    OnePerJoint {
        /// How many joints the servo has.
        expected: usize,
        /// How many positions or velocities there are.
        got: usize,
    },
    /// The message's bytes are no such message.
    #[error("malformed message: {0}")]
    Malformed(String),
}

impl Rejection {
    /// The reason in words, cut.
    pub fn text(&self) -> String {
        cut(&self.to_string()).into_owned()
    }

    /// The reason in one word, as `/diagnostics` counts it.
    pub fn label(&self) -> &'static str {
        match self {
            Self::Number(number) => number.label(),
            Self::NotUnit { .. } => "not_unit",
            Self::UnknownFrame { .. } => "unknown_frame",
            Self::NoTransform { why, .. } => why.label(),
            Self::Late(_) => "late",
            Self::BeyondReach(_) => "beyond_reach",
            Self::Jogging => "jogging",
            Self::Superseded(_) | Self::Overtaken(_) => "superseded",
            Self::StreamsOn(_) => "streams_on",
            Self::NoWayRound(_) => "no_way_round",
            Self::Settings(_) => "settings",
            Self::UnknownArm { .. } => "unknown_arm",
            Self::State(state) => state.label(),
            Self::OnePerJoint { .. } => "wrong_length",
            Self::Malformed(_) => "malformed",
        }
    }
}

/// How many messages were rejected, by reason.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RejectionCounts {
    counts: Vec<(&'static str, u64)>,
    last: Option<Rejection>,
}

impl RejectionCounts {
    /// Counts one. The cycle does, for up to a thousand messages: what they were rejected for is put into words by who reports it.
    pub fn count(&mut self, rejection: &Rejection) {
        let label = rejection.label();
        match self.counts.iter_mut().find(|(reason, _)| *reason == label) {
            Some((_, count)) => *count += 1,
            None => self.counts.push((label, 1)),
        }
        self.last = Some(rejection.clone());
    }

    /// Reason and count, in the order of first appearance.
    pub fn by_reason(&self) -> &[(&'static str, u64)] {
        &self.counts
    }

    /// All of them.
    pub fn total(&self) -> u64 {
        self.counts.iter().map(|(_, count)| count).sum()
    }

    /// The last one.
    pub fn last(&self) -> Option<&Rejection> {
        self.last.as_ref()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thousand_are_counted_without_a_word_and_the_last_is_kept() {
        let why = Rejection::Late(Duration::from_secs(3));
        let mut counts = RejectionCounts::default();
        counts.count(&Rejection::Jogging);
        counts.count(&why);
        let counting = allocation_counter::measure(|| (0..1000).for_each(|_| counts.count(&why)));
        assert_eq!(counting.count_total, 0);
        assert_eq!(counts.by_reason(), [("jogging", 1), ("late", 1001)]);
        assert_eq!(counts.last(), Some(&why));
    }
}
