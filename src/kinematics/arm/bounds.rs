//! Bounds of numbers that come from users and messages.
//!
//! A law multiplies several lengths, squares of lengths, and a gain. So finite but huge numbers could become infinite or NaN on
//! the way to the command. The bounds keep every such product smaller than the largest `f64` by a factor of about 1e200. The
//! ranges of parameters, such as gains (at most 1e4) and limits, are in their declarations.

use super::ArmError;
use std::f64::consts::TAU;
use thiserror::Error;

/// Bound of the lengths of links, of the positions of bases, and of the positions of goals \[m\]. The largest arms, on cranes and
/// space stations, span 20 m to 100 m.
pub const LENGTH: f64 = 1e3;

/// Bound of requested tool speeds [m/s, rad/s]. Requests below this bound are scaled to the speed limits of the arm.
pub const SPEED: f64 = 1e3;

/// Bound of joint positions \[rad, prismatic: m\]. A joint without limits may turn endlessly, but a position beyond 16 000 turns
/// indicates an error in the robot's driver. An `f64` still resolves 1e-11 rad at this bound.
pub const JOINT_ANGLE: f64 = 1e5;

/// Bound of the angles of Denavit–Hartenberg rows: one turn \[rad\]. A larger angle is probably in degrees.
pub const LINK_ANGLE: f64 = TAU;

/// An invalid number.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum NumberError {
    /// The number is infinite or NaN.
    #[error("{field} is {value}: expected a finite number")]
    NonFinite {
        /// The name of the number.
        field: String,
        /// The value of the number.
        value: f64,
    },
    /// The number is finite, but out of bounds.
    #[error("{field} is {value:e} {unit}: expected at most {bound:e} {unit} either way")]
    OutOfRange {
        /// The name of the number.
        field: String,
        /// The value of the number.
        value: f64,
        /// The largest allowed value.
        bound: f64,
        /// The unit of the value and the bound.
        unit: &'static str,
    },
}

impl NumberError {
    /// Returns the name of the error.
    pub fn label(&self) -> &'static str {
        match self {
            Self::NonFinite { .. } => "non_finite",
            Self::OutOfRange { .. } => "out_of_range",
        }
    }
}

/// Checks that `values` are finite and at most `bound` in size. `field` and `unit` are the name and the unit of the values in the
/// error.
///
/// # Errors
/// [`NumberError`] for the first invalid value.
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

/// Checks that `value`, a length \[m\] that belongs to joint number `joint`, is finite and at most [`LENGTH`].
///
/// # Errors
/// [`ArmError::NonFinite`] or [`ArmError::OutOfRange`].
pub fn length(parameter: &'static str, joint: usize, value: f64) -> Result<(), ArmError> {
    match value {
        _ if !value.is_finite() => Err(ArmError::NonFinite { parameter, joint, value }),
        _ if value > LENGTH => {
            Err(ArmError::OutOfRange { parameter, joint, value, bound: LENGTH, unit: "m" })
        }
        _ => Ok(()),
    }
}
