//! Pairs of an angular and a linear vector. Some functions store each number of a vector twice, in both halves of a register
//! (`f64x2`).

use crate::arm::pair::{self, Motions};
use nalgebra::{UnitQuaternion, Vector3};

/// An angular and a linear vector: a twist `(ω, v)` [rad/s, m/s], or an error \[rad, m\].
pub type AngularLinear = (Vector3<f64>, Vector3<f64>);

/// Copies each number into both halves of a register.
#[inline(always)]
pub(super) fn twice((angular, linear): &AngularLinear) -> Motions {
    (pair::twice(angular), pair::twice(linear))
}

/// Returns the number in the first half of each register.
#[inline(always)]
pub(super) fn first((angular, linear): &Motions) -> AngularLinear {
    (angular.map(pair::first), linear.map(pair::first))
}

/// Returns whether the numbers in the first halves of all registers are finite. If their sum overflows, they count as not finite,
/// too.
#[inline(always)]
pub(super) fn is_finite((angular, linear): &Motions) -> bool {
    let sum = angular + linear;
    pair::first(sum.x + sum.y + sum.z).is_finite()
}

/// Returns `√(|ω|² + |v|²)`, in which 1 rad counts as much as 1 m.
#[inline(always)]
pub(super) fn norm((angular, linear): &AngularLinear) -> f64 {
    (angular.norm_squared() + linear.norm_squared()).sqrt()
}

/// Multiplies the angular and the linear vector by one factor each.
#[inline(always)]
pub(super) fn scaled([of_angular, of_linear]: [f64; 2], (angular, linear): &AngularLinear) -> AngularLinear {
    (of_angular * angular, of_linear * linear)
}

/// Returns the six numbers of both vectors, the angular one first.
pub fn six_numbers((angular, linear): &AngularLinear) -> [f64; 6] {
    [angular.x, angular.y, angular.z, linear.x, linear.y, linear.z]
}

/// Rotates both vectors.
pub(super) fn rotated(rotation: &UnitQuaternion<f64>, (angular, linear): &AngularLinear) -> AngularLinear {
    (rotation * angular, rotation * linear)
}
