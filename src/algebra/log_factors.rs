//! The factors of the logarithms, as functions of the cosine of half the angle.

use wide::f64x2;

/// Returns `½θ / sin ½θ` and `β = (1 − ½θ cot ½θ)/θ²`, accurate to rounding, for the angle θ in `[0, π]` with the given
/// `half_cosine` (`cos ½θ`).
///
/// This is fast because both factors are polynomials in `1 − cos ½θ`, which are evaluated in parallel, in four independent sums.
/// The formulas would need a root, an arc tangent and three quotients, one after the other. Near θ = 0 no series is needed,
/// because there is no division by θ.
#[inline(always)]
pub(super) fn log_factors(half_cosine: f64) -> [f64; 2] {
    let x = f64x2::splat(1.0 - half_cosine);
    let square = x * x;
    let fourth = square * square;
    let (fours, rest) = COEFFICIENTS.as_chunks::<4>();
    let of = |numbers: &[f64; 2]| f64x2::new(*numbers);
    let highest = rest.first().map_or(f64x2::ZERO, of);
    let mut sums = [highest, f64x2::ZERO, f64x2::ZERO, f64x2::ZERO];
    for [a, b, c, d] in fours.iter().rev() {
        let [one, two, three, four] = sums;
        sums = [one * fourth + of(a), two * fourth + of(b), three * fourth + of(c), four * fourth + of(d)];
    }
    let [one, two, three, four] = sums;
    ((one + two * x) + (three + four * x) * square).to_array()
}

/// The coefficients of both polynomials. Row i, counted from 0, has the two coefficients of `(1 − cos ½θ)ⁱ`: for `½θ / sin ½θ`,
/// then for β. The polynomials equal the functions at the 21 Chebyshev points of [0, 1], computed with 60 digits. Between these
/// points the relative error is 4e-17.
const COEFFICIENTS: [[f64; 2]; 21] = [
    [1.0, 0.083_333_333_333_333_33],
    [0.333_333_333_333_309_45, 0.011_111_111_111_110_497],
    [0.133_333_333_336_825_26, 0.003_968_253_968_343_605_5],
    [0.057_142_856_940_427_84, 0.001_622_574_950_711_924],
    [0.025_396_831_596_651_948, 0.000_702_795_306_389_823_3],
    [0.011_543_895_604_776_996, 0.000_314_290_607_948_647_9],
    [0.005_329_448_283_051_69, 0.000_143_477_505_617_772_46],
    [0.002_473_760_711_169_737_4, 6.606_778_517_258_03e-5],
    [0.001_251_083_869_870_826, 3.312_828_717_558_515_6e-5],
    [0.000_164_210_479_134_765_15, 4.622_379_973_496_125e-6],
    [0.001_701_113_390_698_554_4, 4.383_582_036_542_753e-5],
    [-0.003_976_427_223_224_787, -0.000_102_013_113_389_001_02],
    [0.009_195_329_684_833_449, 0.000_236_091_871_521_731_3],
    [-0.015_861_705_441_279_71, -0.000_407_199_258_178_234_67],
    [0.021_534_003_435_869_53, 0.000_552_851_490_709_622_2],
    [-0.022_454_256_450_108_755, -0.000_576_486_162_665_321_7],
    [0.017_738_315_969_163_36, 0.000_455_427_922_096_176_65],
    [-0.010_259_274_640_621_51, -0.000_263_415_118_605_041_83],
    [0.004_114_940_516_850_556, 0.000_105_660_414_168_074_89],
    [-0.001_025_639_660_813_829, -2.633_745_548_558_352e-5],
    [0.000_121_173_058_311_165_37, 3.111_996_022_653_278_6e-6],
];

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// Returns `½θ / sin ½θ` and `β = (1 − ½θ cot ½θ)/θ²` for the `angle` θ \[rad\]. The function uses a series with Bernoulli
    /// numbers for β if θ is so small that the formula would lose digits.
    fn formulas(angle: f64) -> [f64; 2] {
        let (half, square) = (0.5 * angle, angle * angle);
        let (sin, cos) = half.sin_cos();
        let by_sine = if angle == 0.0 { 1.0 } else { half / sin };
        let series = [1.0 / 12.0, 1.0 / 720.0, 1.0 / 30_240.0, 1.0 / 1_209_600.0, 1.0 / 47_900_160.0];
        let series = series.into_iter().chain([691.0 / 1_307_674_368_000.0]).rev();
        let beta = match angle < 0.3 {
            true => series.fold(0.0, |sum, coefficient| sum * square + coefficient),
            false => (1.0 - by_sine * cos) / square,
        };
        [by_sine, beta]
    }

    #[test]
    fn the_polynomials_are_the_formulas() {
        let small = (0..300).map(|i| 10_f64.powi(-i));
        for angle in (0..=10_000).map(|i| PI * f64::from(i) / 10_000.0).chain(small) {
            let [by_sine, beta] = log_factors((0.5 * angle).cos());
            let [expected, expected_beta] = formulas(angle);
            assert!((by_sine / expected - 1.0).abs() < 1e-15, "{angle}: {by_sine} {expected}");
            assert!((beta / expected_beta - 1.0).abs() < 1e-13, "{angle}: {beta} {expected_beta}");
        }
    }
}
