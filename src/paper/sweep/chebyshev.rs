//! Steps of the Runge–Kutta–Chebyshev method of second order, which follows a fast decay with few evaluations.
//!
//! Van der Houwen and Sommeijer 1980; Sommeijer, Shampine and Verwer, *RKC: An explicit solver for parabolic PDEs*, 1998, equations
//! (2.1) to (2.6): of `s` evaluations a step may be as long as 0.65 s² over the fastest rate, where the classical methods get 3.3
//! with six. A law that is a transposed Jacobian decays at rates from 0.1 to 300 1/s; that is what decides here.

use super::solution::{Flow, Method, Point, SLOWEST};
use std::sync::LazyLock;

/// The most evaluations in a step.
const MOST_STAGES: usize = 64;

/// The longest step with so many, in times of the fastest decay.
const LONGEST: f64 = ((MOST_STAGES - 1) * (MOST_STAGES - 1) - 1) as f64 / 1.54;

/// The fastest rate is asked for again after so many steps: it changes slowly.
const RATE_STEPS: u32 = 16;

/// The numbers of stage j from 2 on: `Y_j = (1 − μ − ν) Y_0 + μ Y_{j−1} + ν Y_{j−2} + h (μ̃ F_{j−1} + γ̃ F_0)`.
#[derive(Clone, Copy, Debug)]
struct Stage {
    mu: f64,
    nu: f64,
    mu_tilde: f64,
    gamma_tilde: f64,
}

/// The stages of a step with a number of evaluations; `Y_1 = Y_0 + μ̃_1 h F_0`.
#[derive(Clone, Debug)]
struct Stages {
    first: f64,
    stages: Vec<Stage>,
}

/// From two evaluations on.
static STAGES: LazyLock<Vec<Stages>> = LazyLock::new(|| (2..=MOST_STAGES).map(Stages::new).collect());

impl Stages {
    fn new(count: usize) -> Self {
        // A little damping: ε = 2/13.
        let w0 = 1.0 + 2.0 / (13.0 * (count as f64).powi(2));
        // Chebyshev's polynomial and its two derivatives at w0, by their recursion.
        let mut t = vec![[1.0, 0.0, 0.0], [w0, 1.0, 0.0]];
        for j in 2..=count {
            let ([a, da, dda], [b, db, ddb]) = (t[j - 1], t[j - 2]);
            t.push([2.0 * w0 * a - b, 2.0 * (a + w0 * da) - db, 2.0 * (2.0 * da + w0 * dda) - ddb]);
        }
        let w1 = t[count][1] / t[count][2];
        let b = |j: usize| t[j.max(2)][2] / t[j.max(2)][1].powi(2);
        let a = |j: usize| 1.0 - b(j) * t[j][0];
        let stage = |j: usize| {
            let mu_tilde = 2.0 * b(j) * w1 / b(j - 1);
            let (mu, nu) = (2.0 * b(j) * w0 / b(j - 1), -b(j) / b(j - 2));
            Stage { mu, nu, mu_tilde, gamma_tilde: -a(j - 1) * mu_tilde }
        };
        Self { first: b(1) * w1, stages: (2..=count).map(stage).collect() }
    }
}

/// The method, for what decays fast.
pub(super) struct Chebyshev {
    tolerance: f64,
    /// By the law, and with what the last step has seen [1/s].
    law_rate: f64,
    rate: f64,
    steps: u32,
    /// The stage before the last one, and the slope at that.
    stage_before: Vec<f64>,
    slope: Vec<f64>,
}

impl Method for Chebyshev {
    const ERROR_POWER: f64 = 3.0;
    const PARTS: u32 = 1;
    const TOLERANCE: f64 = 1e-5;

    fn new(size: usize, rate: f64, tolerance: f64) -> Self {
        Self {
            tolerance,
            law_rate: rate,
            rate,
            steps: 0,
            stage_before: vec![0.0; size],
            slope: vec![0.0; size],
        }
    }

    fn longest(&self) -> f64 {
        LONGEST / self.rate
    }

    fn attempt(
        &mut self,
        flow: &mut impl Flow,
        step: f64,
        (from, to): (&Point, &mut Point),
        error: &mut [f64],
    ) {
        let count = 1 + (1.0 + 1.54 * step * self.rate).sqrt() as usize;
        let Stages { first, stages } = &STAGES[count.clamp(2, MOST_STAGES) - 2];
        self.stage_before.copy_from_slice(&from.state);
        for (i, slot) in to.state.iter_mut().enumerate() {
            *slot = from.state[i] + first * step * from.velocity[i];
        }
        for Stage { mu, nu, mu_tilde, gamma_tilde } in stages {
            flow.velocity(&to.state, &mut self.slope);
            for i in 0..from.state.len() {
                let change = step * (mu_tilde * self.slope[i] + gamma_tilde * from.velocity[i]);
                let next =
                    (1.0 - mu - nu) * from.state[i] + mu * to.state[i] + nu * self.stage_before[i] + change;
                self.stage_before[i] = std::mem::replace(&mut to.state[i], next);
            }
        }
        flow.velocity(&to.state, &mut to.velocity);
        for (i, slot) in error.iter_mut().enumerate() {
            let moved = to.state[i] - from.state[i];
            *slot = (0.4 * step * (from.velocity[i] + to.velocity[i]) - 0.8 * moved) / self.tolerance;
        }
    }

    fn accepted(&mut self, flow: &impl Flow, from: &Point, to: &Point) {
        let largest = |one: &[f64], other: &[f64]| {
            one.iter().zip(other).fold(0.0_f64, |most, (one, other)| most.max((one - other).abs()))
        };
        // The velocity may change faster than the law's rate says, as near a singularity.
        let moved = largest(&to.state, &from.state);
        let changed = largest(&to.velocity, &from.velocity);
        let secant = if moved > 0.0 { changed / moved } else { 0.0 };
        self.steps += 1;
        if self.steps.is_multiple_of(RATE_STEPS) {
            self.law_rate = flow.fastest_rate();
        }
        self.rate = 1.2 * self.law_rate.max(secant).max(SLOWEST);
    }
}

#[cfg(test)]
mod tests {
    use super::super::solution::tests::{advances_nowhere, follow, order};
    use super::*;

    #[test]
    fn it_is_of_second_order() {
        // Ten times as many steps are a hundred times as precise.
        let order = order::<Chebyshev>([1e-5, 1e-8]);
        assert!((1.7..2.5).contains(&order), "{order}");
    }

    #[test]
    fn fast_rates_cost_little() {
        let (error, asked) = follow::<Chebyshev>([300.0, 1.0], 1e-5);
        assert!(error < 1e-3, "{error}");
        // A classical method of fourth order needs at least 4 · 10 · 300/2.8 = 4286.
        assert!(asked < 1500, "{asked}");
    }

    #[test]
    fn what_has_no_velocity_ends() {
        assert!(!advances_nowhere::<Chebyshev>());
    }
}
