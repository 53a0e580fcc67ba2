//! Why a motion was given up.

use super::{ClosePair, GoalError, Reach};
use dq_kinematics::arm::JointKind;
use serde::{Deserialize, Serialize};

/// Why a motion was given up. Joints are counted from 1, arm after arm.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Stall {
    /// The goal is farther away than the links are long.
    BeyondReach(Reach),
    /// No small motion of the joints brings the arm nearer.
    Unreachable,
    /// The goal lies along a direction that the joints have lost, and the escape was not open, or led nowhere.
    Singular {
        /// The smallest singular value of the Jacobian.
        sigma: f64,
    },
    /// A joint is held back by its position limit.
    AtLimit {
        /// The joint.
        joint: usize,
    },
    /// The arm would come too near to what it must keep out of, or to itself.
    Constrained(ClosePair),
    /// The commands swing to and fro.
    Oscillating,
    /// Something pulls at the joints as much as the law does: the arm stands beside its goal.
    Sagging {
        /// The joint that is pulled at most.
        joint: usize,
        /// How much slower it goes than commanded [rad/s, prismatic: m/s].
        speed: f64,
        /// Of what kind it is.
        kind: JointKind,
        /// How far the arm is from its goal.
        error: GoalError,
    },
    /// The law drives the arm, too slowly or without effect.
    NoProgress,
}

impl Stall {
    /// One word, for programs.
    pub fn name(&self) -> &'static str {
        match self {
            Self::BeyondReach(_) | Self::Unreachable => "unreachable",
            Self::Singular { .. } => "singular",
            Self::AtLimit { .. } => "at_limit",
            Self::Constrained(_) => "constrained",
            Self::Oscillating => "oscillating",
            Self::Sagging { .. } => "sagging",
            Self::NoProgress => "no_progress",
        }
    }

    /// The joint that is held back by its position limit.
    pub(super) fn joint(&self) -> Option<usize> {
        if let Self::AtLimit { joint } = self { Some(*joint) } else { None }
    }

    /// The pair that would come too near to each other.
    pub(super) fn pair(&self) -> Option<ClosePair> {
        if let Self::Constrained(pair) = self { Some(*pair) } else { None }
    }

    /// Whether there may be another configuration of the joints in which nothing holds the arm up.
    pub(super) fn may_be_gone_round(&self) -> bool {
        matches!(self, Self::Unreachable | Self::Singular { .. } | Self::AtLimit { .. })
    }

    /// A sentence for people, and what to try; `joint` names a joint by its number.
    pub fn explain(&self, joint: impl Fn(usize) -> String) -> String {
        let advice = match self {
            Self::BeyondReach(_) => "",
            Self::Unreachable => ": try another orientation, or start from another configuration",
            Self::Singular { .. } => ": try a goal beside it first",
            Self::AtLimit { .. } => {
                ": try a goal that asks less of this joint, or go there from another side"
            }
            Self::Constrained(_) => ": try a goal farther from there, or go there from another side",
            Self::Oscillating => ": try lower gains, or set the parameter latency to the robot's delay",
            Self::Sagging { .. } => ": payload or gravity? Try the parameter integral",
            Self::NoProgress => ": does it follow? Or try higher gains, limits or progress_timeout",
        };
        self.what(joint) + advice
    }

    /// What holds the arm up; `joint` names a joint by its number.
    pub(super) fn what(&self, joint: impl Fn(usize) -> String) -> String {
        match self {
            Self::BeyondReach(Reach { goal, longest }) => {
                format!("unreachable: the goal is {goal:.3} m away, the links reach {longest:.3} m")
            }
            Self::Unreachable => "unreachable: no motion from here brings the arm nearer".to_owned(),
            Self::Singular { sigma } => {
                format!("singular: sigma = {sigma:.1e}, the goal lies along the lost direction")
            }
            Self::AtLimit { joint: number } => format!("{} is at its position limit", joint(*number)),
            Self::Constrained(pair) => pair.explain_hold(joint),
            Self::Oscillating => "oscillating: the commands swing to and fro".to_owned(),
            Self::Sagging { joint: number, speed, kind, error } => format!(
                "stands {:.1} mm and {:.2}° off, as {} sags by {speed:.3} {}/s",
                1e3 * error.position,
                error.rotation.to_degrees(),
                joint(*number),
                kind.unit()
            ),
            Self::NoProgress => "the arm gets no nearer, though it is driven".to_owned(),
        }
    }
}
