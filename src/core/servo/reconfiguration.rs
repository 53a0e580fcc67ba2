//! The way round what a motion has stalled at: another configuration of the joints, in which the goal can be reached.

use super::Stall;
use dq_common::named;
use dq_kinematics::arm::JointKind;
use serde::{Deserialize, Serialize};
use std::time::Duration;
use thiserror::Error;

named! {
    /// Whether an arm that has stalled goes to another configuration of its joints.
    "reconfigure" Reconfigure {
        /// Never, and none is looked for.
        Never = "never",
        /// Where somebody asks for it.
        Ask = "ask",
        /// As soon as one is found.
        Always = "always",
    }
}

/// What another configuration asks of the joint that goes farthest for it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Detour {
    /// The joint, counted from 1 arm after arm.
    pub joint: usize,
    /// What it does.
    pub kind: JointKind,
    /// Where it is \[rad, prismatic: m\].
    pub from: f64,
    /// Where it has to go \[rad, prismatic: m\].
    pub to: f64,
    /// When it was found, by the cycle's clock: who asks for it must have done so since.
    pub found: Duration,
}

/// What is known of another configuration of the joints within their limits in which the goal of a motion can be reached.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum Reconfiguration {
    /// Nothing: none was looked for, or nobody has answered.
    #[default]
    Unknown,
    /// One is looked for, since that time of the cycle's clock.
    Searching(Duration),
    /// There is one, and the arm goes there where somebody asks for it.
    Found(Detour),
    /// None was found.
    NotFound {
        /// From how many starts.
        starts: u32,
    },
    /// The arm goes there.
    Underway(Detour),
    /// The arm has gone there, as far as it could: another one is not looked for.
    Taken,
}

/// Why an arm does not go to another configuration although somebody asks for it.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub enum NoWayRound {
    /// No motion has stalled, or the consent to it is revoked.
    #[error("no goal has stalled: there is nothing to go round")]
    NothingStalled,
    /// No configuration was looked for, as nobody may go there.
    #[error("the parameter reconfigure is never")]
    Never,
    /// No configuration was looked for: another one does not help, or nobody has answered.
    #[error("no other configuration was looked for: {}", .0.explain(|joint| format!("joint {joint}")))]
    NotLookedFor(Stall),
    /// The search goes on.
    #[error("the search for another configuration goes on: ask again")]
    Searching,
    /// There is none.
    #[error("no configuration within the limits was found in {starts} starts")]
    NotFound {
        /// From how many starts it was looked for.
        starts: u32,
    },
    /// The arm is there.
    #[error("the arm has gone to the other configuration already, and has stalled all the same")]
    Taken,
}

impl Reconfiguration {
    /// The word for one that waits for somebody to ask for it.
    pub const FOUND: &str = "found";

    /// One word, for programs.
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

    /// Why a motion has stalled, and what there is to do about it, for people; `joint` names a joint by its number.
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
    /// What it is, for people; `joint` names a joint by its number.
    pub fn explain(&self, joint: impl Fn(usize) -> String) -> String {
        let Self { joint: number, kind, from, to, .. } = self;
        let unit = kind.unit();
        format!("with {} at {to:.2} {unit} instead of {from:.2} {unit} the goal is reachable", joint(*number))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STALL: Stall = Stall::AtLimit { joint: 3 };

    #[test]
    fn a_stall_says_what_to_do_about_it() {
        let found = Duration::from_secs(9);
        let detour = Detour { joint: 3, kind: JointKind::Revolute, from: 2.356, to: -0.52, found };
        let says = |reconfiguration: Reconfiguration| {
            reconfiguration.explain(&STALL, |joint| format!("joint{joint}"))
        };
        assert_eq!(
            says(Reconfiguration::Found(detour)),
            "joint3 is at its position limit; with joint3 at -0.52 rad instead of 2.36 rad the goal is reachable: \
             `dq_servo reconfigure` or ~/reconfigure takes the arm there"
        );
        assert_eq!(
            says(Reconfiguration::NotFound { starts: 256 }),
            "joint3 is at its position limit; no configuration within the limits was found in 256 starts"
        );
        assert_eq!(says(Reconfiguration::Taken), STALL.explain(|joint| format!("joint{joint}")));
    }
}
