//! Vectors of six numbers in two halves, angular and linear, one or two side by side.

use crate::arm::pair;
use nalgebra::Vector3;
use wide::f64x2;

/// A vector of six numbers in two halves, angular and linear.
pub(super) type Halves<T = f64> = (Vector3<T>, Vector3<T>);

/// Two vectors side by side.
#[inline(always)]
pub(super) fn beside(one: &Halves, other: &Halves) -> Halves<f64x2> {
    (pair::beside(&one.0, &other.0), pair::beside(&one.1, &other.1))
}

/// The vector with each number twice.
#[inline(always)]
pub(super) fn twice((angular, linear): &Halves) -> Halves<f64x2> {
    (pair::twice(angular), pair::twice(linear))
}

/// The first of two vectors, with each number twice.
#[inline(always)]
pub(super) fn first_twice((angular, linear): &Halves<f64x2>) -> Halves<f64x2> {
    let first = |numbers: f64x2| {
        let [first, _] = f64x2::transpose([numbers; 2]);
        first
    };
    (angular.map(first), linear.map(first))
}

/// Two vectors, each by itself.
#[inline(always)]
pub(super) fn apart((angular, linear): &Halves<f64x2>) -> [Halves; 2] {
    // An array's own map is not always compiled in place, and this is the control step's.
    let one = |i: usize| {
        let number = |numbers: f64x2| numbers.to_array()[i];
        (angular.map(number), linear.map(number))
    };
    [one(0), one(1)]
}

/// The product of the first vectors and that of the second ones.
#[inline(always)]
pub(super) fn inner(a: &Halves<f64x2>, b: &Halves<f64x2>) -> f64x2 {
    pair::dot(&a.0, &b.0) + pair::dot(&a.1, &b.1)
}

/// Whether the first vector's numbers, and their sum, are finite.
#[inline(always)]
pub(super) fn is_finite((angular, linear): &Halves<f64x2>) -> bool {
    let sum = angular + linear;
    let [first, _] = (sum.x + sum.y + sum.z).to_array();
    first.is_finite()
}
