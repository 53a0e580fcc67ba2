//! Errors in the description of an arm or in its joint positions.

use thiserror::Error;

/// An error in the description of an arm or in its joint positions.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum ArmError {
    /// The chain has no joints.
    #[error("an arm needs at least one joint, got none")]
    NoJoints,
    /// A DH parameter or a length is infinite or NaN.
    #[error("{parameter} of joint {joint} is {value}: expected a finite number")]
    NonFinite {
        /// The name of the number.
        parameter: &'static str,
        /// The number of the joint, counted from 1.
        joint: usize,
        /// The value of the number.
        value: f64,
    },
    /// A DH parameter or a length is larger than in any real arm.
    #[error(
        "{parameter} of joint {joint} is {value} {unit}: expected at most {bound:.5} {unit} either way{}",
        hint(unit)
    )]
    OutOfRange {
        /// The name of the number.
        parameter: &'static str,
        /// The number of the joint, counted from 1.
        joint: usize,
        /// The value of the number.
        value: f64,
        /// The largest allowed value.
        bound: f64,
        /// The unit of the value and the bound.
        unit: &'static str,
    },
    /// The number of joint values does not match the arm.
    #[error("got {got} joint values, expected {expected}: the arm has {expected} joints")]
    JointCount {
        /// The number of joints of the arm.
        expected: usize,
        /// The number of values.
        got: usize,
    },
    /// The length of a list with one entry per joint does not match the arm.
    #[error("got {got} {what}, expected {expected}: the arm has {expected} joints")]
    OnePerJoint {
        /// The name of the list.
        what: &'static str,
        /// The number of joints of the arm.
        expected: usize,
        /// The number of entries in the list.
        got: usize,
    },
    /// The name of the DH convention is unknown.
    #[error("unknown DH convention {0:?}: expected modified_dh or standard_dh")]
    UnknownConvention(String),
}

fn hint(unit: &str) -> &'static str {
    if unit == "rad" { " (is it in degrees?)" } else { "" }
}
