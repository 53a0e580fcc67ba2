//! The reasons why a motion stalls.

use super::{ClosePair, Reach};
use dq_kinematics::arm::JointKind;
use dq_metrics::GoalError;
use serde::{Deserialize, Serialize};

/// The reason why a motion has stalled. Joints are counted from 1, arm after arm.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Stall {
    /// The goal is beyond the arm's reach.
    BeyondReach(Reach),
    /// No small motion of the joints moves the arm nearer to the goal.
    Unreachable,
    /// The arm is at a singularity, where the joints cannot move the tool in the direction of the goal. There was no escape, or the
    /// escape failed.
    Singular {
        /// The smallest singular value of the Jacobian.
        sigma: f64,
    },
    /// A joint is at its position limit.
    AtLimit {
        /// The number of the joint.
        joint: usize,
    },
    /// The arm would come too close to an obstacle or to itself.
    Constrained(ClosePair),
    /// The commands oscillate.
    Oscillating,
    /// A payload or gravity cancels the law's velocity, so that the arm stands short of its goal.
    Sagging {
        /// The number of the joint that the payload or gravity slows most.
        joint: usize,
        /// The commanded speed of the joint, most of which the payload or gravity cancels [rad/s, prismatic: m/s].
        speed: f64,
        /// Whether the joint is revolute or prismatic.
        kind: JointKind,
        /// The error of the arm with respect to its goal.
        error: GoalError,
    },
    /// The law drives the arm too slowly or without effect.
    NoProgress,
}

impl Stall {
    /// Returns the machine-readable name of the reason.
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

    /// Returns the number of the joint whose position limit causes the stall; `None` for another cause.
    pub(super) fn joint(&self) -> Option<usize> {
        if let Self::AtLimit { joint } = self { Some(*joint) } else { None }
    }

    /// Returns the pair of parts whose narrow gap causes the stall; `None` for another cause.
    pub(super) fn pair(&self) -> Option<ClosePair> {
        if let Self::Constrained(pair) = self { Some(*pair) } else { None }
    }

    /// Returns whether another configuration of the joints may help.
    pub(super) fn allows_reconfiguration(&self) -> bool {
        matches!(self, Self::Unreachable | Self::Singular { .. } | Self::AtLimit { .. })
    }

    /// Explains the stall and what to try. `joint` names a joint by its number.
    pub fn explain(&self, joint: impl Fn(usize) -> String) -> String {
        let advice = match self {
            Self::BeyondReach(_) => "",
            Self::Unreachable => ": try another orientation, or start from another configuration",
            Self::Singular { .. } => ": try a goal near it first",
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

    /// Describes what stops the arm. `joint` names a joint by its number.
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
            Self::Oscillating => "oscillating: the commands swing back and forth".to_owned(),
            Self::Sagging { joint: number, speed, kind, error } => format!(
                "stands {:.1} mm and {:.2}° off, because {} sags by {speed:.3} {}/s",
                1e3 * error.position,
                error.rotation.to_degrees(),
                joint(*number),
                kind.unit()
            ),
            Self::NoProgress => "the arm gets no nearer, though it is driven".to_owned(),
        }
    }
}
