//! An angular and a linear vector, one or two of each side by side.

use crate::arm::pair;
use nalgebra::Vector3;
use wide::f64x2;

/// An angular and a linear vector: a twist `(ω, v)` [rad/s, m/s], or an error [rad, m].
pub type AngularLinear<T = f64> = (Vector3<T>, Vector3<T>);

/// The vector with each number twice.
#[inline(always)]
pub(super) fn twice((angular, linear): &AngularLinear) -> AngularLinear<f64x2> {
    (pair::twice(angular), pair::twice(linear))
}

/// The first of two vectors, with each number twice.
#[inline(always)]
pub(super) fn first_twice((angular, linear): &AngularLinear<f64x2>) -> AngularLinear<f64x2> {
    let first = |numbers: f64x2| {
        let [first, _] = f64x2::transpose([numbers; 2]);
        first
    };
    (angular.map(first), linear.map(first))
}

/// Two vectors, each by itself.
#[inline(always)]
pub(super) fn apart((angular, linear): &AngularLinear<f64x2>) -> [AngularLinear; 2] {
    // An array's own map is not always compiled in place, and this is the control step's.
    let one = |i: usize| {
        let number = |numbers: f64x2| numbers.to_array()[i];
        (angular.map(number), linear.map(number))
    };
    [one(0), one(1)]
}

/// Whether the first vector's numbers, and their sum, are finite.
#[inline(always)]
pub(super) fn is_finite((angular, linear): &AngularLinear<f64x2>) -> bool {
    let sum = angular + linear;
    let [first, _] = (sum.x + sum.y + sum.z).to_array();
    first.is_finite()
}

/// `√(|ω|² + |v|²)`, rad and m taken alike.
#[inline(always)]
pub(super) fn norm((angular, linear): &AngularLinear) -> f64 {
    (angular.norm_squared() + linear.norm_squared()).sqrt()
}

/// Each with its factor.
#[inline(always)]
pub(super) fn scaled([of_angular, of_linear]: [f64; 2], (angular, linear): &AngularLinear) -> AngularLinear {
    (of_angular * angular, of_linear * linear)
}
