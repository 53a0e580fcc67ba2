//! The joint limits of a robot description, and those that the user has set as parameters.

use dq_core::servo::{JOINT_JERKS, JOINT_SPEEDS, RAMP_TIME, STOP_TIME};
use dq_description::JointLimits;
use dq_params::{ParameterOverride, Value};
use std::ops::RangeInclusive;

/// The time from rest to the velocity limit \[s\]. It determines the acceleration limit of joints for which the description has no
/// such limit.
const TIME_TO_FULL_SPEED: f64 = 0.5;

/// The limits of a joint on acceleration and deceleration [rad/s², prismatic: m/s²] and on jerk [rad/s³, prismatic: m/s³].
pub(super) struct Dynamics {
    pub acceleration: f64,
    pub deceleration: f64,
    pub jerk: f64,
}

impl Dynamics {
    /// Computes the limits on acceleration, deceleration and jerk of a joint from the `limits` in its description and its speed limit
    /// `velocity`. As in URDF, a missing deceleration equals the acceleration, and a missing jerk is unlimited.
    ///
    /// A deceleration that does not stop the joint within [`STOP_TIME`] is raised. So is a jerk with which the joint does not reach
    /// its acceleration or deceleration limit within [`RAMP_TIME`].
    pub fn of(limits: &JointLimits, velocity: f64) -> Self {
        let given =
            |limit: Option<f64>, range: RangeInclusive<f64>| limit.filter(|limit| range.contains(limit));
        let most = *JOINT_SPEEDS.end();
        let acceleration = given(limits.acceleration, JOINT_SPEEDS);
        let acceleration = acceleration.unwrap_or(most.min(velocity / TIME_TO_FULL_SPEED));
        let deceleration = given(limits.deceleration, JOINT_SPEEDS).unwrap_or(acceleration);
        let deceleration = deceleration.max(velocity / STOP_TIME);
        let least = acceleration.max(deceleration) / RAMP_TIME;
        let jerk = given(limits.jerk, JOINT_JERKS).unwrap_or(*JOINT_JERKS.end()).max(least);
        Self { acceleration, deceleration, jerk }
    }
}

/// Returns a list for the joints of all arms, arm after arm. `joints` has the number of joints of each arm. If every arm has as
/// many joints as `list` has numbers, the result repeats `list` for each arm. Otherwise the result is `list` itself.
pub(super) fn for_each_arm(list: Vec<f64>, joints: &[usize]) -> Vec<f64> {
    if joints.iter().all(|count| *count == list.len()) { list.repeat(joints.len()) } else { list }
}

/// Returns the speed limit of a joint [rad/s, prismatic: m/s]; `None` if the limit is missing or invalid.
pub(super) fn speed(limits: &JointLimits) -> Option<f64> {
    limits.velocity.filter(|limit| JOINT_SPEEDS.contains(limit))
}

/// The joint limits that the user has set as parameters.
pub(super) struct GivenLimits {
    pub velocity: Option<Vec<f64>>,
    acceleration: Option<Vec<f64>>,
    pub deceleration: Option<Vec<f64>>,
    lower: Option<Vec<f64>>,
    upper: Option<Vec<f64>>,
}

impl GivenLimits {
    /// Collects the joint limits among the `given` values. `joints` has the number of joints of each arm. If there are two arms with
    /// equally many joints, limits for one arm count for both.
    pub fn find(given: &[ParameterOverride], joints: &[usize]) -> Self {
        let list = |name: &str| {
            let last = given.iter().rev().find(|value| value.name == name)?;
            match last.value.clone().convert_like(&Value::DoubleArray(Vec::new())) {
                Ok(Value::DoubleArray(list)) => Some(for_each_arm(list, joints)),
                // A value of another type is rejected when the store takes it.
                _ => Some(Vec::new()),
            }
        };
        Self {
            velocity: list("limits.joint_velocity"),
            acceleration: list("limits.joint_acceleration"),
            deceleration: list("limits.joint_deceleration"),
            lower: list("limits.joint_position_lower"),
            upper: list("limits.joint_position_upper"),
        }
    }

    /// Returns whether both position limits are given.
    pub fn has_range(&self) -> bool {
        self.lower.is_some() && self.upper.is_some()
    }

    /// Returns the effective limits of the joint with the index `joint`: the limits that the user has set, and otherwise `limits`, the
    /// joint's limits in the description.
    pub fn of(&self, joint: usize, limits: &JointLimits) -> JointLimits {
        let given = |list: &Option<Vec<f64>>| list.as_ref().and_then(|list| list.get(joint).copied());
        let (lower, upper) = limits.range().unzip();
        JointLimits {
            lower: given(&self.lower).or(lower),
            upper: given(&self.upper).or(upper),
            velocity: given(&self.velocity).or(limits.velocity),
            acceleration: given(&self.acceleration).or(limits.acceleration),
            deceleration: given(&self.deceleration).or(limits.deceleration),
            ..*limits
        }
    }
}
