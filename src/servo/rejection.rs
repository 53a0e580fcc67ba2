//! Why a message, or settings, were not taken.

use super::{Rearm, SettingsError};
use crate::frames::FrameError;
use crate::text::cut;
use std::time::Duration;
use thiserror::Error;

/// A message, or settings, that the servo rejected; the last good ones stay in force.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum Rejection {
    /// A number is infinite or not a number.
    #[error("{field} is {value}: expected a finite number")]
    NonFinite {
        /// Which number.
        field: String,
        /// Its value.
        value: f64,
    },
    /// A number that is finite, but larger than any that is meant.
    #[error("{field} is {value:e} {unit}: expected at most {bound:e} {unit} either way")]
    OutOfRange {
        /// Which number.
        field: String,
        /// Its value.
        value: f64,
        /// The largest that it may be.
        bound: f64,
        /// Their unit.
        unit: &'static str,
    },
    /// The quaternion's norm is too far from 1 to be rounding.
    #[error("the orientation has norm {norm}: expected 1 ± {tolerance}")]
    NotUnit {
        /// The norm.
        norm: f64,
        /// What is let pass.
        tolerance: f64,
    },
    /// The goal is in a frame that the servo does not know.
    #[error("frame_id is {got:?}: expected {expected} or an empty one")]
    UnknownFrame {
        /// The frame of the goal or twist.
        got: String,
        /// The frames that the servo knows, each in quotes.
        expected: String,
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
    /// A goal or twist that was sent before the servo could have been meant.
    #[error("it was sent {:.3} s before this servo was there, by its sender's clock: send it again", .0.as_secs_f64())]
    LeftOver(Duration),
    /// A goal that came while a twist rules.
    #[error("a twist on target_twist rules: goals are taken again when it has ceased")]
    Jogging,
    /// A goal that waited for its frame, until it was not wanted any more.
    #[error("while the goal waited for TF {}: send it again", .0.explain(|joint| format!("joint {joint}")))]
    Overtaken(Rearm),
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
    /// A joint of the arm is not in the joint state.
    #[error("joint {joint:?} is not in the joint state (it has {names:?})")]
    MissingJoint {
        /// The joint.
        joint: String,
        /// The first names of the message.
        names: Vec<String>,
    },
    /// The lists of a joint state have different lengths.
    #[error("{names} joint names with {positions} positions: expected as many of each")]
    WrongLength {
        /// Names in the message.
        names: usize,
        /// Positions in the message.
        positions: usize,
    },
    /// The message's bytes are no such message.
    #[error("malformed message: {0}")]
    Malformed(String),
}

impl Rejection {
    /// The reason in one word, as `/diagnostics` counts it.
    pub fn label(&self) -> &'static str {
        match self {
            Self::NonFinite { .. } => "non_finite",
            Self::OutOfRange { .. } => "out_of_range",
            Self::NotUnit { .. } => "not_unit",
            Self::UnknownFrame { .. } => "unknown_frame",
            Self::NoTransform { why, .. } => why.label(),
            Self::LeftOver(_) => "left_over",
            Self::Jogging => "jogging",
            Self::Overtaken(_) => "overtaken",
            Self::Settings(_) => "settings",
            Self::UnknownArm { .. } => "unknown_arm",
            Self::MissingJoint { .. } => "missing_joint",
            Self::WrongLength { .. } => "wrong_length",
            Self::Malformed(_) => "malformed",
        }
    }
}

/// How many messages were rejected, by reason.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RejectionCounts {
    counts: Vec<(&'static str, u64)>,
    last: Option<String>,
}

impl RejectionCounts {
    /// Counts one.
    pub fn count(&mut self, rejection: &Rejection) {
        let label = rejection.label();
        match self.counts.iter_mut().find(|(reason, _)| *reason == label) {
            Some((_, count)) => *count += 1,
            None => self.counts.push((label, 1)),
        }
        self.last = Some(cut(&rejection.to_string()).into_owned());
    }

    /// Reason and count, in the order of first appearance.
    pub fn by_reason(&self) -> &[(&'static str, u64)] {
        &self.counts
    }

    /// All of them.
    pub fn total(&self) -> u64 {
        self.counts.iter().map(|(_, count)| count).sum()
    }

    /// The last reason in words.
    pub fn last(&self) -> Option<&str> {
        self.last.as_deref()
    }
}
