//! Why the arm stands, or is not driven as its law would.

use super::{Rearm, Rivals};
use std::fmt;

/// A reason in words, where the state alone does not say enough.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reason {
    /// The goal is older than the robot's presence (state `holding`).
    Rearm(Rearm),
    /// Two publishers give joint states of one arm (state `holding`).
    Rivals(Rivals),
    /// Nobody subscribes to the commands for the arm of this number (state `not_following`).
    NobodyListens(usize),
    /// The arm of this number does not move as commanded (state `not_following`).
    DoesNotMove(usize),
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Rearm(why) => why.fmt(f),
            Self::Rivals(Rivals { first, second, .. }) => {
                write!(f, "publishers {first} and {second} both give joint states of the arm")
            }
            Self::NobodyListens(_) => f.write_str("nobody subscribes to the commands"),
            Self::DoesNotMove(_) => f.write_str(
                "the arm does not move as commanded: is its controller active? It is tried gently once a second",
            ),
        }
    }
}
