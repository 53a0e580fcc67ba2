//! Two numbers in one register, or two vectors in three registers, for two joints that are computed at once.

use nalgebra::Vector3;
use wide::f64x2;

/// Two vectors. The first register has both x, the second both y, the third both z.
pub(crate) type Pair = Vector3<f64x2>;

/// A pair of zero vectors. As a constant it needs no loop, unlike nalgebra's `Vector3::zeros()`.
pub(crate) const ZEROS: Pair = Vector3::new(f64x2::ZERO, f64x2::ZERO, f64x2::ZERO);

/// The motions that two joints give a tool at unit joint speed: first the two angular velocities of the tool, then the two
/// velocities of the tool point.
pub(crate) type Motions = (Pair, Pair);

/// Loads the first two of `numbers` into a register. A missing second number is 0.
#[inline(always)]
pub(crate) fn two(numbers: &[f64]) -> f64x2 {
    match numbers.first_chunk() {
        Some(both) => f64x2::new(*both),
        None => f64x2::new([numbers.first().copied().unwrap_or(0.0), 0.0]),
    }
}

/// Returns the first of the two numbers in a register.
#[inline(always)]
pub(crate) fn first(numbers: f64x2) -> f64 {
    let [first, _] = numbers.to_array();
    first
}

/// Puts two numbers into one register.
///
/// This is fast because it avoids memory: loading two numbers right after they were stored separately would stall.
#[inline(always)]
pub(crate) fn side_by_side(first: f64, second: f64) -> f64x2 {
    let [numbers, _] = f64x2::transpose([f64x2::splat(first), f64x2::splat(second)]);
    numbers
}

/// Puts two vectors into one pair.
#[inline(always)]
pub(crate) fn beside(one: &Vector3<f64>, other: &Vector3<f64>) -> Pair {
    one.zip_map(other, side_by_side)
}

/// Stores both numbers of a register in `room`. If `room` has length 1, stores only the first number.
#[inline(always)]
pub(crate) fn put(numbers: f64x2, room: &mut [f64]) {
    let [first, second] = numbers.to_array();
    match room {
        [one, other, ..] => (*one, *other) = (first, second),
        [one] => *one = first,
        [] => (),
    }
}

/// Returns the pair that contains the vector `v` twice.
#[inline(always)]
pub(crate) fn twice(v: &Vector3<f64>) -> Pair {
    v.map(f64x2::splat)
}

/// Returns two dot products: of the first vectors of `a` and `b`, and of their second vectors.
#[inline(always)]
pub(crate) fn dot(a: &Pair, b: &Pair) -> f64x2 {
    a.x * b.x + a.y * b.y + a.z * b.z
}

/// Returns the sum of the two vectors, in both halves of the result.
#[inline(always)]
pub(crate) fn sum_twice(v: &Pair) -> Pair {
    v.map(|numbers| {
        let [first, second] = numbers.to_array();
        numbers + f64x2::new([second, first])
    })
}
