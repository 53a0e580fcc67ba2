//! The reasons why the servo rejects a message or settings.

use super::{JointGoalError, NoWayRound, Reach, Revocation, SettingsError};
use dq_algebra::NotUnit;
use dq_common::text::cut;
use dq_contact::TooFewDirections;
use dq_kinematics::arm::bounds::NumberError;
use dq_link::StateError;
use dq_space::frames::FrameError;
use std::time::Duration;
use thiserror::Error;

/// The reason why the servo rejected a message or settings. The last valid message or settings remain in force.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum Rejection {
    /// A number is not finite or out of bounds.
    #[error(transparent)]
    Number(#[from] NumberError),
    /// The quaternion's norm is too far from 1 to be a rounding error.
    #[error(transparent)]
    NotUnit(#[from] NotUnit),
    /// The servo does not accept the frame of the goal, twist or wrench.
    #[error("frame_id is {got:?}: expected {} or an empty one", expected.iter().map(|frame| format!("{frame:?}")).collect::<Vec<_>>().join(", "))]
    UnknownFrame {
        /// The name of the frame in the message.
        got: String,
        /// The names of the frames that the servo accepts.
        expected: Vec<String>,
    },
    /// TF does not have the frame of the goal.
    #[error("frame_id is {got:?}, not {expected:?}, and {why}")]
    NoTransform {
        /// The frame of the goal.
        got: String,
        /// The base frame.
        expected: String,
        /// The reason why TF does not have the frame.
        why: FrameError,
    },
    /// The goal, twist or request was too old on arrival, or was sent before the servo started. The field is its age on arrival.
    #[error("it arrived {:.1} s after it was sent, by its sender's clock: send it again", .0.as_secs_f64())]
    Late(Duration),
    /// The arm cannot reach the goal.
    #[error(
        "the goal is {:.3} m away, and the arm reaches {:.3} m (with goal_beyond_reach approach the arm goes as near as it can)",
        .0.goal, .0.longest
    )]
    BeyondReach(Reach),
    /// The joint goal is invalid.
    #[error(transparent)]
    JointGoal(#[from] JointGoalError),
    /// The goal arrived while a twist is in force.
    #[error("a twist on target_twist is in force: goals are accepted again when it has ended")]
    Jogging,
    /// The goal was sent before a revocation, or its publisher has continued without a silence since the revocation.
    #[error("after its publisher began to send {}: let it send nothing for 1.5 s, and then send the goal again", .0.explain(|joint| format!("joint {joint}")))]
    Superseded(Revocation),
    /// The request to resume was sent before the last revocation.
    #[error("after it was sent {}: ask again if the arm may go on", .0.explain(|joint| format!("joint {joint}")))]
    Overtaken(Revocation),
    /// The request to resume came while a publisher still sends revoked goals. If the servo resumed, the arm would move to an old
    /// goal, because the servo rejects the newer ones.
    #[error("goals are sent on since {}: let their publisher send nothing for 1.5 s, and then ask again", .0.explain(|joint| format!("joint {joint}")))]
    StreamsOn(Revocation),
    /// The request to move to another configuration cannot be met.
    #[error(transparent)]
    NoWayRound(#[from] NoWayRound),
    /// The load on the sensor cannot be identified.
    #[error(transparent)]
    Load(#[from] TooFewDirections),
    /// The settings are invalid.
    #[error("the settings are rejected: {0}")]
    Settings(#[from] SettingsError),
    /// The joint state is of an arm that the servo does not have.
    #[error("a joint state of the arm number {arm}, expected a number below {arms}")]
    UnknownArm {
        /// The number of the arm, counted from 0.
        arm: usize,
        /// The number of arms.
        arms: usize,
    },
    /// The joint state is invalid.
    #[error(transparent)]
    State(#[from] StateError),
    /// The number of positions or velocities differs from the number of joints.
    #[error("{got} numbers, expected {expected}: one per joint, arm after arm")]
    OnePerJoint {
        /// The number of joints of the servo.
        expected: usize,
        /// The number of positions or velocities.
        got: usize,
    },
    /// The bytes of a message cannot be decoded.
    #[error("malformed message: {0}")]
    Malformed(String),
}

impl Rejection {
    /// Returns the rejection of a message in the frame `got`. The servo accepts the frames `expected`.
    pub(super) fn unknown_frame<S: Into<String>>(got: &str, expected: impl IntoIterator<Item = S>) -> Self {
        let expected = expected.into_iter().map(Into::into).collect();
        Self::UnknownFrame { got: cut(got).into_owned(), expected }
    }

    /// Returns the reason in words, cut to the maximum length of a message.
    pub fn text(&self) -> String {
        cut(&self.to_string()).into_owned()
    }

    /// Returns the name of the reason, as in `/diagnostics`.
    pub fn label(&self) -> &'static str {
        match self {
            Self::Number(number) => number.label(),
            Self::NotUnit { .. } => "not_unit",
            Self::UnknownFrame { .. } => "unknown_frame",
            Self::NoTransform { why, .. } => why.label(),
            Self::Late(_) => "late",
            Self::BeyondReach(_) => "beyond_reach",
            Self::JointGoal(why) => why.label(),
            Self::Jogging => "jogging",
            Self::Superseded(_) | Self::Overtaken(_) => "superseded",
            Self::StreamsOn(_) => "streams_on",
            Self::NoWayRound(_) => "no_way_round",
            Self::Load(_) => "too_few_directions",
            Self::Settings(_) => "settings",
            Self::UnknownArm { .. } => "unknown_arm",
            Self::State(state) => state.label(),
            Self::OnePerJoint { .. } => "wrong_length",
            Self::Malformed(_) => "malformed",
        }
    }
}

/// The number of rejected messages for each reason.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RejectionCounts {
    counts: Vec<(&'static str, u64)>,
    last: Option<Rejection>,
}

impl RejectionCounts {
    /// Counts one rejection. Does not format the text of the rejection, because there may be a thousand rejections in one cycle.
    pub fn count(&mut self, rejection: &Rejection) {
        let label = rejection.label();
        match self.counts.iter_mut().find(|(reason, _)| *reason == label) {
            Some((_, count)) => *count += 1,
            None => self.counts.push((label, 1)),
        }
        self.last = Some(rejection.clone());
    }

    /// Returns each reason and its count, in the order in which the reasons first appeared.
    pub fn by_reason(&self) -> &[(&'static str, u64)] {
        &self.counts
    }

    /// Returns the total count.
    pub fn total(&self) -> u64 {
        self.counts.iter().map(|(_, count)| count).sum()
    }

    /// Returns the last rejection, or `None` if there was none.
    pub fn last(&self) -> Option<&Rejection> {
        self.last.as_ref()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counting_a_thousand_rejections_allocates_nothing_and_keeps_the_last() {
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
