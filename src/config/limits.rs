//! Completes the joint limits that parameters set, so that they become the limits of a servo.

use super::common::exactly_or_none;
use super::described_limits::for_each_arm;
use dq_core::servo::{Limits, RAMP_TIME, STOP_TIME};
use dq_kinematics::arm::JointKind;
use dq_params::{ParameterError, exactly};

/// Completes each list of limits, so that the list has one number for each joint of these arms. If there are two arms with equally
/// many joints, a list for one arm counts for both.
///
/// # Errors
/// [`ParameterError::Invalid`] for a list of another length, and for limits with which a joint cannot accelerate or stop within
/// the required time.
pub(super) fn complete(limits: &mut Limits, arms: &[&[JointKind]]) -> Result<(), ParameterError> {
    let (joints, counts) = (&arms.concat()[..], arms.iter().map(|kinds| kinds.len()).collect::<Vec<_>>());
    let count = joints.len();
    for list in [
        &mut limits.joint_velocity,
        &mut limits.joint_acceleration,
        &mut limits.joint_deceleration,
        &mut limits.joint_jerk,
        &mut limits.position.lower,
        &mut limits.position.upper,
    ] {
        *list = for_each_arm(std::mem::take(list), &counts);
    }
    exactly("limits.joint_velocity", &limits.joint_velocity, count)?;
    exactly("limits.joint_acceleration", &limits.joint_acceleration, count)?;
    exactly_or_none("limits.joint_deceleration", &limits.joint_deceleration, count)?;
    check_stops(limits, joints)?;
    if limits.joint_deceleration.is_empty() {
        limits.joint_deceleration.clone_from(&limits.joint_acceleration);
    }
    if let [all] = limits.joint_jerk[..] {
        limits.joint_jerk = vec![all; count];
    }
    fill("limits.jerk", &mut limits.joint_jerk, f64::INFINITY, count)?;
    fill("limits.joint_position_lower", &mut limits.position.lower, f64::NEG_INFINITY, count)?;
    fill("limits.joint_position_upper", &mut limits.position.upper, f64::INFINITY, count)?;
    check_ranges(limits.position.ranges(), joints)?;
    check_ramps(limits, joints)
}

/// Fills an empty list with `count` times the value `none`, which means no limit. Checks that any other list has `count` numbers.
fn fill(name: &'static str, list: &mut Vec<f64>, none: f64, count: usize) -> Result<(), ParameterError> {
    if list.is_empty() {
        list.resize(count, none);
    }
    exactly(name, list, count)
}

/// Checks that the jerk limits let each joint reach its acceleration and deceleration limits within [`RAMP_TIME`].
fn check_ramps(limits: &Limits, joints: &[JointKind]) -> Result<(), ParameterError> {
    check("limits.jerk", &limits.joint_jerk, |joint| {
        let least = limits.jerk(joint);
        let what = "brings it to its acceleration and deceleration";
        let expected =
            || format!("at least {least} {}/s^3, which {what} in {RAMP_TIME} s", joints[joint].unit());
        (limits.joint_jerk[joint] < least).then(expected)
    })
}

/// Checks that the deceleration limits stop each joint from its velocity limit within [`STOP_TIME`].
fn check_stops(limits: &Limits, joints: &[JointKind]) -> Result<(), ParameterError> {
    let given = &limits.joint_deceleration;
    check("limits.joint_deceleration", given, |joint| {
        let least = limits.joint_velocity[joint] / STOP_TIME;
        let what = "stops it from its velocity limit";
        let expected =
            || format!("at least {least} {}/s^2, which {what} in {STOP_TIME} s", joints[joint].unit());
        (given[joint] < least).then(expected)
    })
}

/// Checks that the position limits of each joint form a range.
pub(super) fn check_ranges(
    ranges: impl Iterator<Item = (f64, f64)>,
    joints: &[JointKind],
) -> Result<(), ParameterError> {
    let (lower, upper): (Vec<_>, Vec<_>) = ranges.unzip();
    check("limits.joint_position_upper", &upper, |joint| {
        let (least, unit) = (lower[joint], joints[joint].unit());
        let expected = || format!("a position above the joint's lower limit, {least} {unit}");
        (upper[joint] <= least).then(expected)
    })
}

/// Checks the numbers in `list`, one per joint. `expected` checks the number of a joint (counted from 0): if the number is invalid,
/// `expected` returns a description of the valid numbers.
fn check(
    name: &'static str,
    list: &[f64],
    expected: impl Fn(usize) -> Option<String>,
) -> Result<(), ParameterError> {
    match (0..list.len()).find_map(|joint| Some((joint, expected(joint)?))) {
        Some((joint, expected)) => {
            let value = format!("{} for joint {}", list[joint], joint + 1);
            Err(ParameterError::invalid(name, value, expected))
        }
        None => Ok(()),
    }
}
