//! Checks that settings are valid for a servo.

use super::{Interface, Limits, Settings};
use dq_kinematics::control::{Controller, Law};
use std::slice::from_ref;
use std::time::Duration;
use thiserror::Error;

/// Invalid settings or joint names.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum SettingsError {
    /// A list does not have one entry for each joint of all arms.
    #[error("{list} has {got} entries, expected {expected}: one per joint")]
    Length {
        /// The name of the list.
        list: &'static str,
        /// The number of joints.
        expected: usize,
        /// The number of entries in the list.
        got: usize,
    },
    /// A number is invalid.
    #[error("{name} has {value}, expected {expected}")]
    Number {
        /// The name of the number.
        name: &'static str,
        /// The number.
        value: f64,
        /// A description of the valid numbers.
        expected: &'static str,
    },
    /// The settings are for another kind of commands than the servo was created for.
    #[error("interface is {got}, expected {expected}: it cannot change while the servo runs")]
    AnotherInterface {
        /// The kind that the servo was created for.
        expected: Interface,
        /// The requested kind.
        got: Interface,
    },
}

/// Checks that the list `list` has one entry per joint.
pub(super) fn check_length(list: &'static str, got: usize, expected: usize) -> Result<(), SettingsError> {
    if got == expected { Ok(()) } else { Err(SettingsError::Length { list, expected, got }) }
}

/// Checks that the control period is not 0.
pub(super) fn check_period(period: Duration) -> Result<(), SettingsError> {
    match period.is_zero() {
        true => Err(SettingsError::Number { name: "period", value: 0.0, expected: "a time above 0" }),
        false => Ok(()),
    }
}

/// A check of a number, and a description of the valid numbers.
type Taken = (fn(f64) -> bool, &'static str);

const FINITE: Taken = (f64::is_finite, "a finite number");
const SIZE: Taken = (|value| value.is_finite() && value >= 0.0, "a finite number not below 0");
const BOUND: Taken = (|value| !value.is_nan(), "a number, or an infinite one for no limit");
const TOLERANCE: Taken = (|value| value >= 0.0, "a number not below 0");

fn check_each(name: &'static str, numbers: &[f64], (is_taken, expected): Taken) -> Result<(), SettingsError> {
    match numbers.iter().copied().find(|number| !is_taken(*number)) {
        Some(value) => Err(SettingsError::Number { name, value, expected }),
        None => Ok(()),
    }
}

impl Settings {
    /// Checks that these settings are valid for a servo with `joint_count` joints and commands of the kind `interface`. The servo
    /// then accepts them at any time.
    ///
    /// # Errors
    /// [`SettingsError`] for the first invalid setting.
    pub fn check(&self, joint_count: usize, interface: Interface) -> Result<(), SettingsError> {
        self.check_lengths(joint_count)?;
        self.check_numbers()?;
        if self.interface != interface {
            return Err(SettingsError::AnotherInterface { expected: interface, got: self.interface });
        }
        Ok(())
    }

    fn check_lengths(&self, joint_count: usize) -> Result<(), SettingsError> {
        let (limits, posture) = (&self.limits, &self.posture.positions);
        for (list, numbers) in [
            ("limits.joint_velocity", &limits.joint_velocity),
            ("limits.joint_acceleration", &limits.joint_acceleration),
            ("limits.joint_deceleration", &limits.joint_deceleration),
            ("limits.jerk", &limits.joint_jerk),
            ("limits.position.lower", &limits.position.lower),
            ("limits.position.upper", &limits.position.upper),
        ] {
            check_length(list, numbers.len(), joint_count)?;
        }
        if let Some(scene) = &self.scene {
            check_length("scene", scene.joint_count(), joint_count)?;
        }
        match posture.len() {
            0 => Ok(()),
            got => check_length("posture.positions", got, joint_count),
        }
    }

    fn check_numbers(&self) -> Result<(), SettingsError> {
        let Limits { joint_velocity, joint_acceleration, joint_deceleration, joint_jerk, position, .. } =
            &self.limits;
        let Controller { damping, .. } = &self.controller;
        let offset = self.tool_offset.to_vector8();
        let numbers: [(&'static str, &[f64], Taken); 18] = [
            ("tool_offset", offset.as_slice(), FINITE),
            ("hysteresis", from_ref(&self.hysteresis), SIZE),
            ("damping.max", from_ref(&damping.max), SIZE),
            ("damping.threshold", from_ref(&damping.threshold), SIZE),
            ("limits.joint_velocity", joint_velocity, SIZE),
            ("limits.joint_acceleration", joint_acceleration, SIZE),
            ("limits.joint_deceleration", joint_deceleration, SIZE),
            ("limits.jerk", joint_jerk, TOLERANCE),
            ("limits.linear_speed", from_ref(&self.limits.linear_speed), SIZE),
            ("limits.angular_speed", from_ref(&self.limits.angular_speed), SIZE),
            ("limits.position.lower", &position.lower, BOUND),
            ("limits.position.upper", &position.upper, BOUND),
            ("limits.position.margin", from_ref(&position.margin), SIZE),
            ("posture.positions", &self.posture.positions, FINITE),
            ("posture.gain", from_ref(&self.posture.gain), SIZE),
            ("goal_tolerance.linear", from_ref(&self.goal_tolerance.linear), TOLERANCE),
            ("goal_tolerance.angular", from_ref(&self.goal_tolerance.angular), TOLERANCE),
            ("following_error", from_ref(&self.following_error), TOLERANCE),
        ];
        for (name, numbers, taken) in numbers {
            check_each(name, numbers, taken)?;
        }
        for law in Law::all() {
            check_each(law.parameter(), &self.controller.gains(law), SIZE)?;
        }
        let mut ranges = position.ranges();
        let crossed = ranges.find_map(|(lower, upper)| (upper < lower).then_some(upper));
        let (name, expected) = ("limits.position.upper", "a number not below the lower limit");
        crossed.map_or(Ok(()), |value| Err(SettingsError::Number { name, value, expected }))
    }
}
