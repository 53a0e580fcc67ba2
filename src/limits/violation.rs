//! Violations of the rules by commands and positions.

use dq_space::space::Pair;
use thiserror::Error;

/// A violation of a safety rule by a command or by joint positions. Joints are counted from 1, arm after arm.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum Violation {
    /// The command or the list of positions does not have one number per joint.
    #[error("{got} numbers for {expected} joints")]
    WrongLength {
        /// The number of joints.
        expected: usize,
        /// The number of values.
        got: usize,
    },
    /// A number is infinite or NaN.
    #[error("joint {joint}: {value} is not finite")]
    NonFinite {
        /// The number of the joint.
        joint: usize,
        /// The value.
        value: f64,
    },
    /// A speed exceeds the velocity limit (rule 5).
    #[error("joint {joint}: {speed} is beyond the velocity limit of {limit} [rad/s, prismatic: m/s]")]
    Velocity {
        /// The number of the joint.
        joint: usize,
        /// The speed of the joint [rad/s, prismatic: m/s].
        speed: f64,
        /// The velocity limit [rad/s, prismatic: m/s].
        limit: f64,
    },
    /// A command changes a joint's speed by more than the limits on acceleration and deceleration allow in the time since the last
    /// command (rule 6).
    #[error(
        "joint {joint}: a step of {step}, but the limits on acceleration allow {limit} [rad/s, prismatic: m/s]"
    )]
    Acceleration {
        /// The number of the joint.
        joint: usize,
        /// The change of the speed [rad/s, prismatic: m/s].
        step: f64,
        /// The largest allowed change of the speed [rad/s, prismatic: m/s].
        limit: f64,
    },
    /// Two successive commands change a joint's speed by amounts that differ by more than the jerk limit allows (rule 6).
    #[error(
        "joint {joint}: a step changes by {change}, but the limit on jerk allows {limit} [rad/s, prismatic: m/s]"
    )]
    Jerk {
        /// The number of the joint.
        joint: usize,
        /// The difference between the two changes of speed, each in one cycle [rad/s, prismatic: m/s].
        change: f64,
        /// The largest allowed difference [rad/s, prismatic: m/s].
        limit: f64,
    },
    /// A commanded speed is outside the [envelope](crate::Envelope): a stop from this speed would exceed a limit (rules 5, 6 and
    /// 7).
    #[error("joint {joint}: {speed} is not between {lowest} and {highest} [rad/s, prismatic: m/s]")]
    Envelope {
        /// The number of the joint.
        joint: usize,
        /// The speed of the joint [rad/s, prismatic: m/s].
        speed: f64,
        /// The lowest allowed speed [rad/s, prismatic: m/s].
        lowest: f64,
        /// The highest allowed speed [rad/s, prismatic: m/s].
        highest: f64,
    },
    /// The arm must come to rest, but a joint brakes with less than its deceleration, or moves again (rules 1, 2, 3, 9 and ~/pause,
    /// ~/stop).
    #[error(
        "joint {joint}: {speed} after {before} [rad/s, prismatic: m/s], where the arm was to come to rest and to stay there"
    )]
    NotStanding {
        /// The number of the joint.
        joint: usize,
        /// The speed of the joint [rad/s, prismatic: m/s].
        speed: f64,
        /// The speed of the joint at the previous command [rad/s, prismatic: m/s].
        before: f64,
    },
    /// A tool exceeds its speed limit (rule 5).
    #[error("a tool at {speed} {unit} is beyond its limit of {limit} {unit}")]
    ToolSpeed {
        /// The speed of the tool.
        speed: f64,
        /// The speed limit.
        limit: f64,
        /// The unit of `speed` and `limit`.
        unit: &'static str,
    },
    /// The arm overlaps with an obstacle or with itself, or the tool is outside its keep-in (rule 22).
    #[error("{}", .pair.explain_gap(*.gap, |joint| format!("joint {joint}")))]
    Gap {
        /// The two parts of the scene.
        pair: Pair,
        /// The signed distance between the two parts \[m\], negative for an overlap.
        gap: f64,
    },
    /// A joint has moved beyond its position limit, or farther beyond it than before (rule 7).
    #[error("joint {joint}: at {position}, {beyond} beyond its position limit [rad, prismatic: m]")]
    Position {
        /// The number of the joint.
        joint: usize,
        /// The position of the joint \[rad, prismatic: m\].
        position: f64,
        /// The distance beyond the limit \[rad, prismatic: m\].
        beyond: f64,
    },
}
