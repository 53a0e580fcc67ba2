//! Two numbers, or two vectors, side by side: those of two joints, of which both are computed at once.

use nalgebra::Vector3;
use wide::f64x2;

/// Two vectors side by side.
pub(crate) type Pair = Vector3<f64x2>;

/// Zeros: of a library's vector of one element the compiler makes a loop.
pub(crate) const ZEROS: Pair = Vector3::new(f64x2::ZERO, f64x2::ZERO, f64x2::ZERO);

/// What two joints do to a tool, for each unit of their own speeds: how they turn it, and the velocity of its point.
pub(crate) type Motions = (Pair, Pair);

/// The first two numbers, or one and 0.
#[inline(always)]
pub(crate) fn two(numbers: &[f64]) -> f64x2 {
    match numbers.first_chunk() {
        Some(both) => f64x2::new(*both),
        None => f64x2::new([numbers.first().copied().unwrap_or(0.0), 0.0]),
    }
}

/// The first of two numbers.
#[inline(always)]
pub(crate) fn first(numbers: f64x2) -> f64 {
    let [first, _] = numbers.to_array();
    first
}

/// Two numbers side by side.
///
/// Fast because it is made in a register: two numbers that are stored one by one are waited for by who loads both.
#[inline(always)]
pub(crate) fn side_by_side(first: f64, second: f64) -> f64x2 {
    let [numbers, _] = f64x2::transpose([f64x2::splat(first), f64x2::splat(second)]);
    numbers
}

/// Two vectors side by side.
#[inline(always)]
pub(crate) fn beside(one: &Vector3<f64>, other: &Vector3<f64>) -> Pair {
    one.zip_map(other, side_by_side)
}

/// Puts both numbers where there is room for two, or the first.
#[inline(always)]
pub(crate) fn put(numbers: f64x2, room: &mut [f64]) {
    let [first, second] = numbers.to_array();
    match room {
        [one, other, ..] => (*one, *other) = (first, second),
        [one] => *one = first,
        [] => (),
    }
}

/// The same vector twice.
#[inline(always)]
pub(crate) fn twice(v: &Vector3<f64>) -> Pair {
    v.map(f64x2::splat)
}

/// The products of the first vectors and of the second ones.
#[inline(always)]
pub(crate) fn dot(a: &Pair, b: &Pair) -> f64x2 {
    a.x * b.x + a.y * b.y + a.z * b.z
}

/// The sum of both vectors, twice.
#[inline(always)]
pub(crate) fn sum_twice(v: &Pair) -> Pair {
    v.map(|numbers| {
        let [first, second] = numbers.to_array();
        numbers + f64x2::new([second, first])
    })
}
