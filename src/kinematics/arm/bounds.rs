//! How large the numbers may be that come in from outside.
//!
//! A law multiplies some lengths, their squares and a gain, so numbers that are finite but huge become infinite or NaN on the
//! way to the command. What is bounded as below keeps every product some two hundred decades away from that. What a parameter
//! may be, gains (at most 1e4) and limits among them, is in its declaration.

use super::ArmError;
use std::f64::consts::TAU;
use thiserror::Error;

/// Lengths \[m\]: of links, of bases, of goals. The largest arms, on cranes and space stations, span some 20 m to 100 m.
pub const LENGTH: f64 = 1e3;

/// Speeds of tools that somebody asks for [m/s, rad/s]: the limits scale what is less to what the arm may do.
pub const SPEED: f64 = 1e3;

/// Positions of joints \[rad, prismatic: m\]. Joints without limits may turn without end, but 16 000 turns are a fault of the robot's driver; a
/// double still resolves 1e-11 rad there.
pub const JOINT_ANGLE: f64 = 1e5;

/// Angles of Denavit–Hartenberg rows \[rad\]: a turn is all that there is. More is a file in degrees.
pub const LINK_ANGLE: f64 = TAU;

/// A number that is not taken.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum NumberError {
    /// It is infinite or not a number.
    #[error("{field} is {value}: expected a finite number")]
    NonFinite {
        /// Which number.
        field: String,
        /// Its value.
        value: f64,
    },
    /// It is finite, but larger than any that is meant.
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
}

impl NumberError {
    /// The reason in one word.
    pub fn label(&self) -> &'static str {
        match self {
            Self::NonFinite { .. } => "non_finite",
            Self::OutOfRange { .. } => "out_of_range",
        }
    }
}

/// Checks that `values` are finite and at most `bound` either way, in that `unit`; `field` names them.
///
/// # Errors
/// [`NumberError`] for the first that is not.
pub fn check(
    field: impl FnOnce() -> String,
    values: &[f64],
    bound: f64,
    unit: &'static str,
) -> Result<(), NumberError> {
    let is_taken = |value: &&f64| value.abs() <= bound;
    match values.iter().find(|value| !is_taken(value)).copied() {
        None => Ok(()),
        Some(value) if value.is_finite() => {
            Err(NumberError::OutOfRange { field: field(), value, bound, unit })
        }
        Some(value) => Err(NumberError::NonFinite { field: field(), value }),
    }
}

/// Checks a length \[m\] of joint `joint` against [`LENGTH`].
///
/// # Errors
/// [`ArmError::NonFinite`], [`ArmError::OutOfRange`].
pub fn length(parameter: &'static str, joint: usize, value: f64) -> Result<(), ArmError> {
    match value {
        _ if !value.is_finite() => Err(ArmError::NonFinite { parameter, joint, value }),
        _ if value > LENGTH => {
            Err(ArmError::OutOfRange { parameter, joint, value, bound: LENGTH, unit: "m" })
        }
        _ => Ok(()),
    }
}
