//! Two numbers, or two vectors, side by side: those of two joints, of which both are computed at once.

use nalgebra::Vector3;
use wide::f64x2;

/// Two vectors side by side.
pub(crate) type Pair = Vector3<f64x2>;

/// The first two numbers, or one and 0.
#[inline(always)]
pub(crate) fn two(numbers: &[f64]) -> f64x2 {
    match numbers {
        [first, second, ..] => f64x2::new([*first, *second]),
        [first] => f64x2::new([*first, 0.0]),
        [] => f64x2::ZERO,
    }
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

/// The sum of both vectors.
#[inline(always)]
pub(crate) fn sum(v: &Pair) -> Vector3<f64> {
    v.map(f64x2::reduce_add)
}

/// The sum of both vectors, twice.
#[inline(always)]
pub(crate) fn sum_twice(v: &Pair) -> Pair {
    v.map(|numbers| {
        let [first, second] = numbers.to_array();
        numbers + f64x2::new([second, first])
    })
}
