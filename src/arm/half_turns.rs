//! Cosines and sines of half angles, several at once.

/// So many angles are handled at once.
pub(super) const LANES: usize = 6;

/// Beyond this angle \[rad\] a number of half turns times the long part of π is not exact any more.
const LARGEST: f64 = 1e6;

/// π in two parts: the first has so few digits that its product with a number of half turns is exact.
const PI_LONG: f64 = 3.141_592_621_803_283_7;
/// π without its long part.
const PI_SHORT: f64 = 3.178_650_954_705_639e-8;

/// Adding and subtracting 1.5·2⁵² rounds to an integer, and leaves the integer's last bit in the sum's last bit.
const ROUNDER: f64 = 6_755_399_441_055_744.0;

/// Cosines and sines of half of each angle \[rad\].
///
/// Fast because all angles take the same steps without a branch, so that the compiler puts two into one register: libm's `sin_cos`
/// goes through them one by one, and is a third of the kinematics. With k half turns taken off, `½θ = kπ + 2y`, and |y| ≤ ¼π the Taylor
/// series of y are exact to the last digit; then `sin 2y = 2 sin y cos y`, `cos 2y = 1 − 2 sin² y`, and an odd k changes both signs.
pub(super) fn half_turns(angles: &[f64; LANES]) -> ([f64; LANES], [f64; LANES]) {
    if angles.iter().any(|angle| angle.abs() > LARGEST) {
        return (angles.map(|angle| (0.5 * angle).cos()), angles.map(|angle| (0.5 * angle).sin()));
    }
    let (mut cosines, mut sines) = ([0.0; LANES], [0.0; LANES]);
    for ((angle, cosine), sine) in angles.iter().zip(&mut cosines).zip(&mut sines) {
        let rounded = angle * (0.5 * std::f64::consts::FRAC_1_PI) + ROUNDER;
        let half_turns = rounded - ROUNDER;
        let y = 0.5 * (0.5 * angle - half_turns * PI_LONG - half_turns * PI_SHORT);
        let square = y * y;
        let sin = y * (1.0 + square * horner(square, &SINE));
        let cos = 1.0 + square * horner(square, &COSINE);
        let odd = rounded.to_bits() << 63;
        let with_sign = |value: f64| f64::from_bits(value.to_bits() ^ odd);
        (*cosine, *sine) = (with_sign(1.0 - 2.0 * sin * sin), with_sign(2.0 * sin * cos));
    }
    (cosines, sines)
}

/// Coefficients of y³, y⁵ … of the sine, by y: −1/3!, 1/5! …; the last one first.
const SINE: [f64; 7] = [
    -1.0 / 1_307_674_368_000.0,
    1.0 / 6_227_020_800.0,
    -1.0 / 39_916_800.0,
    1.0 / 362_880.0,
    -1.0 / 5_040.0,
    1.0 / 120.0,
    -1.0 / 6.0,
];

/// Coefficients of y², y⁴ … of the cosine: −1/2!, 1/4! …; the last one first.
const COSINE: [f64; 8] = [
    1.0 / 20_922_789_888_000.0,
    -1.0 / 87_178_291_200.0,
    1.0 / 479_001_600.0,
    -1.0 / 3_628_800.0,
    1.0 / 40_320.0,
    -1.0 / 720.0,
    1.0 / 24.0,
    -1.0 / 2.0,
];

/// The polynomial in x with these coefficients, that of the highest power first.
fn horner<const N: usize>(x: f64, coefficients: &[f64; N]) -> f64 {
    coefficients.iter().fold(0.0, |sum, coefficient| sum * x + coefficient)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn check(angle: f64) {
        let (cosines, sines) = half_turns(&[angle; LANES]);
        let (sin, cos) = (0.5 * angle).sin_cos();
        for (cosine, sine) in cosines.into_iter().zip(sines) {
            assert!((cosine - cos).abs() < 5e-16 && (sine - sin).abs() < 5e-16, "{angle}");
        }
    }

    #[test]
    fn multiples_of_quarter_turns_and_the_ends_of_the_range_are_as_libm_has_them() {
        (-4000..4000).map(|n| f64::from(n) * std::f64::consts::FRAC_PI_8).for_each(check);
        [0.0, 1e-300, 5e-324, 999_999.9, -1e6, 1e6 + 1.0, -1e300].into_iter().for_each(check);
        assert!(half_turns(&[f64::NAN; LANES]).0[0].is_nan());
    }

    proptest! {
        #[test]
        fn any_angle_is_as_libm_has_it(small in -10.0..10.0f64, large in -1.1e6..1.1e6f64) {
            check(small);
            check(large);
        }
    }
}
