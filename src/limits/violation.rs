//! What commands and positions may break.

use dq_space::space::Pair;
use thiserror::Error;

/// An invariant that a command did not hold. Joints are counted from 1, arm after arm.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum Violation {
    /// Not one number a joint.
    #[error("{got} numbers for {expected} joints")]
    WrongLength {
        /// Joints that have limits.
        expected: usize,
        /// Numbers there were.
        got: usize,
    },
    /// Infinite, or not a number.
    #[error("joint {joint}: {value} is not finite")]
    NonFinite {
        /// The joint.
        joint: usize,
        /// What was found.
        value: f64,
    },
    /// Faster than the velocity limit (rule 5).
    #[error("joint {joint}: {speed} is beyond the velocity limit of {limit} [rad/s, prismatic: m/s]")]
    Velocity {
        /// The joint.
        joint: usize,
        /// Its speed [rad/s].
        speed: f64,
        /// What it may have [rad/s].
        limit: f64,
    },
    /// A larger step than the limits on acceleration and deceleration allow in the time (rule 6).
    #[error(
        "joint {joint}: a step of {step}, where the limits on acceleration allow {limit} [rad/s, prismatic: m/s]"
    )]
    Acceleration {
        /// The joint.
        joint: usize,
        /// The step [rad/s].
        step: f64,
        /// What it may be [rad/s].
        limit: f64,
    },
    /// A step that differs by more from the one before than the limit on jerk allows (rule 6).
    #[error(
        "joint {joint}: a step that is another one by {change}, where the limit on jerk allows {limit} [rad/s, prismatic: m/s]"
    )]
    Jerk {
        /// The joint.
        joint: usize,
        /// By how much it differs [rad/s].
        change: f64,
        /// By how much it may [rad/s].
        limit: f64,
    },
    /// Not one of the speeds from which a stop keeps the limits (rules 5, 6 and 7).
    #[error("joint {joint}: {speed} is not between {lowest} and {highest} [rad/s, prismatic: m/s]")]
    Envelope {
        /// The joint.
        joint: usize,
        /// Its speed [rad/s].
        speed: f64,
        /// What it may have at least [rad/s].
        lowest: f64,
        /// What it may have at most [rad/s].
        highest: f64,
    },
    /// Not slowed down by the joint's deceleration although there was reason to stand (rules 1, 2, 3, 9 and ~/pause, ~/stop).
    #[error(
        "joint {joint}: {speed} after {before} [rad/s, prismatic: m/s], where the arm was to come to rest and to stay there"
    )]
    NotStanding {
        /// The joint.
        joint: usize,
        /// Its speed [rad/s].
        speed: f64,
        /// Its speed before [rad/s].
        before: f64,
    },
    /// A tool that is faster than its limit (rule 5).
    #[error("a tool at {speed} {unit} is beyond its limit of {limit} {unit}")]
    ToolSpeed {
        /// Its speed.
        speed: f64,
        /// What it may have.
        limit: f64,
        /// Their unit.
        unit: &'static str,
    },
    /// In what the arm must keep out of, or in itself, or out of what the tool must stay in (rule 22).
    #[error("{}", .pair.explain_gap(*.gap, |joint| format!("joint {joint}")))]
    Gap {
        /// The two.
        pair: Pair,
        /// The gap between them \[m\].
        gap: f64,
    },
    /// Farther beyond its position limit than it has been (rule 7).
    #[error("joint {joint}: at {position}, {beyond} beyond its position limit [rad, prismatic: m]")]
    Position {
        /// The joint.
        joint: usize,
        /// Where it is \[rad\].
        position: f64,
        /// How far beyond the limit \[rad\].
        beyond: f64,
    },
}
