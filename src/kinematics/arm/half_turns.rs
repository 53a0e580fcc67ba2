//! Cosines and sines of half angles, for two angles at once.

use std::f64::consts::FRAC_1_PI;
use wide::{bytemuck, f64x2, u64x2};

/// Largest angle \[rad\] for which the product of `PI_LONG` and the number of half turns has no rounding error.
const LARGEST: f64 = 1e6;

/// π, rounded so that the last bits of its mantissa are 0. So its product with a number of half turns has no rounding error.
const PI_LONG: f64 = 3.141_592_621_803_283_7;
/// The difference `π − PI_LONG`.
const PI_SHORT: f64 = 3.178_650_954_705_639e-8;

/// Adding and then subtracting this number, 1.5·2⁵², rounds to an integer. The last bit of the sum is the last bit of that integer.
const ROUNDER: f64 = 6_755_399_441_055_744.0;

/// Returns the cosines and sines of `½θ + offset` for two angles θ \[rad\], each with its own offset of at most π.
///
/// This is fast because both angles take the same steps in one register, without a branch. libm's `sin_cos` computes one angle
/// after the other, and would take half of the time of the kinematics. After k half turns are subtracted, `½θ + offset = kπ + 2y`.
/// For |y| ≤ ¼π, short polynomials in y² are accurate to the last digit. Then `sin 2y = 2 sin y cos y` and `cos 2y = 1 − 2 sin² y`;
/// an odd k changes both signs. The even and the odd powers of y² are summed in parallel, because each power depends on the power
/// before it. The function is inlined into the calling loop, because two numbers passed through memory would stall the loop.
#[inline(always)]
pub(super) fn half_turns(angles: f64x2, offsets: f64x2) -> (f64x2, f64x2) {
    if angles.to_array().iter().any(|angle| angle.abs() > LARGEST) {
        let turns = (0.5 * angles + offsets).to_array();
        return (f64x2::new(turns.map(f64::cos)), f64x2::new(turns.map(f64::sin)));
    }
    let rounded = (angles * (0.5 * FRAC_1_PI) + offsets * FRAC_1_PI) + ROUNDER;
    let half_turns = rounded - ROUNDER;
    let (long, short) = (half_turns * (0.5 * PI_LONG), half_turns * (0.5 * PI_SHORT));
    let y = (0.25 * angles - long) + (0.5 * offsets - short);
    let square = y * y;
    let sin = y + (square * y) * series(square, &SINE);
    let cos = 1.0 + square * series(square, &COSINE);
    let odd: f64x2 = bytemuck::cast(bytemuck::cast::<f64x2, u64x2>(rounded) << 63_u32);
    let twice = sin + sin;
    ((1.0 - twice * sin) ^ odd, (twice * cos) ^ odd)
}

/// Coefficients of y³, y⁵ … y¹³ in the polynomial for `sin y`. The first list has the coefficients of y¹¹, y⁷ and y³, the second
/// those of y¹³, y⁹ and y⁵. The coefficient of y is 1. The polynomial equals the sine at six Chebyshev points
/// of y², computed with 60 digits. Between these points its error is at most 1.3e-17.
const SINE: ([f64; 3], [f64; 3]) = (
    [-2.505_113_184_500_362_4e-8, -1.984_126_983_675_885_7e-4, -0.166_666_666_666_666_66],
    [1.591_812_929_486_660_8e-10, 2.755_731_610_255_244e-6, 8.333_333_333_330_948e-3],
);

/// Coefficients of y², y⁴ … y¹⁴ in the polynomial for `cos y`. The first list has the coefficients of y¹⁴, y¹⁰, y⁶ and y², the
/// second those of y¹², y⁸ and y⁴. The constant is 1. The polynomial equals the cosine at seven points; its error is at most
/// 1.2e-19.
const COSINE: ([f64; 4], [f64; 3]) = (
    [-1.136_799_865_402_249_4e-11, -2.755_731_556_634_189_5e-7, -1.388_888_888_888_077_5e-3, -0.5],
    [2.087_588_673_804_705_2e-9, 2.480_158_729_369_346e-5, 0.041_666_666_666_666_64],
);

/// Evaluates the polynomial in x with these even and odd coefficients, the highest power first.
fn series<const N: usize, const M: usize>(x: f64x2, (even, odd): &([f64; N], [f64; M])) -> f64x2 {
    let square = x * x;
    horner(square, even) + x * horner(square, odd)
}

/// Evaluates the polynomial in x with these coefficients, the highest power first.
fn horner<const N: usize>(x: f64x2, coefficients: &[f64; N]) -> f64x2 {
    let [first, rest @ ..] = coefficients.as_slice() else { return f64x2::ZERO };
    rest.iter().fold(f64x2::splat(*first), |sum, coefficient| sum * x + *coefficient)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::f64::consts::PI;

    fn check(angle: f64, offset: f64) {
        let (cosines, sines) = half_turns(f64x2::splat(angle), f64x2::splat(offset));
        // The sum `½θ + offset` itself would have a rounding error.
        let (sin, cos) = (0.5 * angle).sin_cos();
        let (sin, cos) = (sin * offset.cos() + cos * offset.sin(), cos * offset.cos() - sin * offset.sin());
        for (cosine, sine) in cosines.to_array().into_iter().zip(sines.to_array()) {
            let limit = if offset == 0.0 { 5e-16 } else { 1e-15 };
            assert!((cosine - cos).abs() < limit && (sine - sin).abs() < limit, "{angle} {offset}");
        }
    }

    #[test]
    fn multiples_of_quarter_turns_and_the_ends_of_the_range_match_libm() {
        (-4000..4000).map(|n| f64::from(n) * std::f64::consts::FRAC_PI_8).for_each(|angle| check(angle, 0.0));
        [0.0, 1e-300, 5e-324, 999_999.9, -1e6, 1e6 + 1.0, -1e300]
            .into_iter()
            .for_each(|angle| check(angle, 0.0));
        assert!(half_turns(f64x2::splat(f64::NAN), f64x2::ZERO).0.to_array()[0].is_nan());
    }

    proptest! {
        #[test]
        fn any_angle_matches_libm(small in -10.0..10.0f64, large in -1e6..1e6f64, beyond in -1.1e6..1.1e6f64, offset in -PI..PI) {
            check(small, 0.0);
            check(beyond, 0.0);
            check(small, offset);
            check(large, offset);
        }
    }
}
