//! Ranges that several parameters have.

use std::ops::RangeInclusive;

/// Gains [1/s] and limits are above zero by at least this.
pub(super) const POSITIVE: f64 = 1e-6;

/// Limits of joints' speeds and accelerations [rad/s, rad/s², prismatic: m/s, m/s²].
pub(super) const JOINT_SPEEDS: RangeInclusive<f64> = POSITIVE..=1e4;

/// Limits of joints' jerks [rad/s³, prismatic: m/s³].
pub(super) const JOINT_JERKS: RangeInclusive<f64> = POSITIVE..=1e6;
