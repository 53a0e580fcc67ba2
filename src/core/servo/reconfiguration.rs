//! Reconfiguration of a stalled motion: another configuration of the joints in which the goal can be reached.

use super::Stall;
use dq_common::named;
use dq_kinematics::arm::JointKind;
use serde::{Deserialize, Serialize};
use std::time::Duration;
use thiserror::Error;

named! {
    /// Whether a stalled arm moves to another configuration of its joints.
    "reconfigure" Reconfigure {
        /// Never. The servo does not search for another configuration.
        Never = "never",
        /// When the user requests it.
        Ask = "ask",
        /// As soon as the search has found another configuration.
        Always = "always",
    }
}

/// Another configuration, described by the joint that moves farthest on the way to it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Detour {
    /// The number of the joint, counted from 1, arm after arm.
    pub joint: usize,
    /// Whether the joint is revolute or prismatic.
    pub kind: JointKind,
    /// The position of the joint when the search found the configuration \[rad, prismatic: m\].
    pub from: f64,
    /// The position of the joint in the other configuration \[rad, prismatic: m\].
    pub to: f64,
    /// When the search found the configuration, by the cycle's clock. If a request to move to the configuration was sent before this
    /// time, the servo rejects it.
    pub found: Duration,
}

/// Information about another configuration in which the goal of a motion can be reached within the joint limits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum Reconfiguration {
    /// Nothing is known: there was no search, or it did not answer in time.
    #[default]
    Unknown,
    /// A search has been under way since this time of the cycle's clock.
    Searching(Duration),
    /// The search has found a configuration. The arm moves to it on request.
    Found(Detour),
    /// The search has found nothing.
    NotFound {
        /// The number of configurations from which the search started.
        starts: u32,
    },
    /// The arm is moving to the other configuration.
    Underway(Detour),
    /// The arm has moved to the other configuration, as far as it could. The servo does not search again for this motion.
    Taken,
}

/// The reason why the servo rejects a request to move to another configuration.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub enum NoWayRound {
    /// No motion has stalled, or the arm has no consent to move.
    #[error("no motion has stalled: no other configuration is needed")]
    NothingStalled,
    /// There was no search, because the parameter `reconfigure` is `never`.
    #[error("the parameter reconfigure is never")]
    Never,
    /// There is no result of a search: another configuration would not help against this stall, or the search did not answer in
    /// time.
    #[error("no other configuration was searched: {}", .0.explain(|joint| format!("joint {joint}")))]
    NotLookedFor(Stall),
    /// The search is still under way.
    #[error("the search for another configuration goes on: ask again")]
    Searching,
    /// The search found no configuration.
    #[error("no configuration within the limits was found in {starts} starts")]
    NotFound {
        /// The number of configurations from which the search started.
        starts: u32,
    },
    /// The arm has already moved to the other configuration.
    #[error("the arm has already moved to the other configuration, and has stalled again")]
    Taken,
}

impl Reconfiguration {
    /// The name of [`Reconfiguration::Found`] in messages: there is a configuration to which the arm moves on request.
    pub const FOUND: &str = "found";

    /// Returns the machine-readable name, as in messages.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Unknown => "unknown",
            Self::Searching(_) => "searching",
            Self::Found(_) => Self::FOUND,
            Self::NotFound { .. } => "not_found",
            Self::Underway(_) => "underway",
            Self::Taken => "taken",
        }
    }

    /// Explains why a motion has stalled and what to do about it. `joint` names a joint by its number.
    pub fn explain(&self, stall: &Stall, joint: impl Fn(usize) -> String) -> String {
        match self {
            Self::Found(detour) => format!(
                "{}; {}: `dq_servo reconfigure` or ~/reconfigure takes the arm there",
                stall.what(&joint),
                detour.explain(&joint)
            ),
            Self::NotFound { starts } => {
                format!("{}; {}", stall.what(joint), NoWayRound::NotFound { starts: *starts })
            }
            Self::Unknown | Self::Searching(_) | Self::Underway(_) | Self::Taken => stall.explain(joint),
        }
    }
}

impl Detour {
    /// Describes the other configuration in words. `joint` names a joint by its number.
    pub fn explain(&self, joint: impl Fn(usize) -> String) -> String {
        let Self { joint: number, kind, from, to, .. } = self;
        let unit = kind.unit();
        format!("with {} at {to:.2} {unit} instead of {from:.2} {unit} the goal is reachable", joint(*number))
    }
}
