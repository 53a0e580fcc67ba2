//! What cannot be an arm, or its joint angles.

use thiserror::Error;

/// An error of the arm room.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum ArmError {
    /// A chain without joints.
    #[error("an arm needs at least one joint, got none")]
    NoJoints,
    /// A DH parameter, or a length, is infinite or not a number.
    #[error("{parameter} of joint {joint} is {value}: expected a finite number")]
    NonFinite {
        /// Which parameter.
        parameter: &'static str,
        /// The joint, counted from 1.
        joint: usize,
        /// Its value.
        value: f64,
    },
    /// A DH parameter, or a length, larger than any arm's.
    #[error(
        "{parameter} of joint {joint} is {value} {unit}: expected at most {bound:.5} {unit} either way{}",
        hint(unit)
    )]
    OutOfRange {
        /// Which parameter.
        parameter: &'static str,
        /// The joint, counted from 1.
        joint: usize,
        /// Its value.
        value: f64,
        /// The largest that it may be.
        bound: f64,
        /// Their unit.
        unit: &'static str,
    },
    /// A list of joint values that does not fit the arm.
    #[error("got {got} joint values, expected {expected}: the arm has {expected} joints")]
    JointCount {
        /// How many the arm has.
        expected: usize,
        /// How many there were.
        got: usize,
    },
    /// Names, or other things that each joint has one of, that do not fit the arm.
    #[error("got {got} {what}, expected {expected}: the arm has {expected} joints")]
    OnePerJoint {
        /// What each joint has one of.
        what: &'static str,
        /// How many joints the arm has.
        expected: usize,
        /// How many there were.
        got: usize,
    },
    /// A name that is no DH convention.
    #[error("unknown DH convention {0:?}: expected modified_dh or standard_dh")]
    UnknownConvention(String),
}

fn hint(unit: &str) -> &'static str {
    if unit == "rad" { " (is it in degrees?)" } else { "" }
}
