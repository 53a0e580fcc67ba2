//! Steps of the Runge–Kutta method of fifth order by Dormand and Prince, *A family of embedded Runge–Kutta formulae*, 1980, table 2.

use super::solution::{Flow, Method, Point, speed_between};

/// What of the slopes so far leads to the next stage; the last row is the step itself.
const STAGES: [&[f64]; 6] = [
    &[1.0 / 5.0],
    &[3.0 / 40.0, 9.0 / 40.0],
    &[44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0],
    &[19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0],
    &[9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0],
    &[35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0],
];

/// The step less that of the embedded method of fourth order.
const ERROR: [f64; 7] =
    [71.0 / 57600.0, 0.0, -71.0 / 16695.0, 71.0 / 1920.0, -17253.0 / 339_200.0, 22.0 / 525.0, -1.0 / 40.0];

/// A stage inside of a step: at which part of it, and its number.
const INSIDE: (f64, usize) = (0.8, 3);

/// At that stage the velocity is on the parabola through the step, but for this part of the fastest one at the step's ends: that a law
/// begins to damp shows in the velocity first, and as a peak.
const PEAK: f64 = 0.01;

/// The method, for what decays slowly: six evaluations a step.
pub(super) struct DormandPrince {
    tolerance: f64,
    /// At the stages, the first of them at the step's beginning.
    slopes: [Vec<f64>; 7],
}

impl Method for DormandPrince {
    const ERROR_POWER: f64 = 5.0;
    const PARTS: u32 = 3;
    const TOLERANCE: f64 = 1e-6;

    fn new(size: usize, _: f64, tolerance: f64) -> Self {
        Self { tolerance, slopes: std::array::from_fn(|_| vec![0.0; size]) }
    }

    /// A step that is not stable is one whose error is too large.
    fn longest(&self) -> f64 {
        f64::INFINITY
    }

    fn attempt(
        &mut self,
        flow: &mut impl Flow,
        step: f64,
        (from, to): (&Point, &mut Point),
        error: &mut [f64],
    ) {
        self.slopes[0].copy_from_slice(&from.velocity);
        for (number, weights) in STAGES.iter().enumerate() {
            let (known, next) = self.slopes.split_at_mut(number + 1);
            for (i, slot) in to.state.iter_mut().enumerate() {
                *slot = from.state[i] + step * weighted(weights, known, i);
            }
            flow.velocity(&to.state, &mut next[0]);
        }
        to.velocity.copy_from_slice(&self.slopes[6]);
        let fastest = fastest(from).max(fastest(to));
        for (i, slot) in error.iter_mut().enumerate() {
            let parabola = speed_between([from, to], step, INSIDE.0, i);
            let peak = (self.slopes[INSIDE.1][i] - parabola).abs() / (PEAK * fastest);
            *slot = (step * weighted(&ERROR, &self.slopes, i) / self.tolerance).abs().max(peak);
        }
    }
}

fn fastest(point: &Point) -> f64 {
    point.velocity.iter().fold(0.0, |most, speed| most.max(speed.abs()))
}

fn weighted(weights: &[f64], slopes: &[Vec<f64>], i: usize) -> f64 {
    weights.iter().zip(slopes).map(|(weight, slope)| weight * slope[i]).sum()
}

#[cfg(test)]
mod tests {
    use super::super::solution::tests::{advances_nowhere, follow, order};
    use super::*;

    #[test]
    fn it_is_of_fifth_order() {
        let order = order::<DormandPrince>([1e-8, 1e-10]);
        assert!((4.3..6.5).contains(&order), "{order}");
    }

    #[test]
    fn slow_rates_cost_little() {
        let (error, asked) = follow::<DormandPrince>([1.0, 2.0], 1e-5);
        assert!(error < 1e-4, "{error}");
        assert!(asked < 250, "{asked}");
    }

    #[test]
    fn what_has_no_velocity_ends() {
        assert!(!advances_nowhere::<DormandPrince>());
    }
}
