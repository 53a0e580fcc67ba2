//! Steps of the Runge–Kutta–Chebyshev method of second order, which follows a fast decay with few evaluations.
//!
//! Van der Houwen and Sommeijer 1980; Sommeijer, Shampine and Verwer, *RKC: An explicit solver for parabolic PDEs*, 1998, equations
//! (2.1) to (2.6): of `s` evaluations a step may be as long as 0.65 s² over the fastest rate, where the classical methods get 3.3
//! with six. A law that is a transposed Jacobian decays at rates from 0.1 to 300 1/s; that is what decides here.

use std::sync::LazyLock;

/// A system `ẋ = v(x)`.
pub(super) trait Flow {
    /// Writes v at `state`.
    fn velocity(&mut self, state: &[f64], velocity: &mut [f64]);

    /// The fastest rate of decay where the velocity was last asked for [1/s].
    fn fastest_rate(&self) -> f64;
}

/// The most evaluations in a step.
const MOST_STAGES: usize = 64;

/// The longest step with so many, in times of the fastest decay.
const LONGEST: f64 = ((MOST_STAGES - 1) * (MOST_STAGES - 1) - 1) as f64 / 1.54;

/// The fastest rate is asked for again after so many steps: it changes slowly.
const RATE_STEPS: u32 = 4;

/// What is slower than this [1/s] is no rate to choose a first step by.
const SLOWEST: f64 = 1e-3;

/// The numbers of stage j from 2 on: `Y_j = (1 − μ − ν) Y_0 + μ Y_{j−1} + ν Y_{j−2} + h (μ̃ F_{j−1} + γ̃ F_0)`.
#[derive(Clone, Copy, Debug)]
struct Stage {
    mu: f64,
    nu: f64,
    mu_tilde: f64,
    gamma_tilde: f64,
}

/// The method with a number of evaluations; `Y_1 = Y_0 + μ̃_1 h F_0`.
#[derive(Clone, Debug)]
struct Method {
    first: f64,
    stages: Vec<Stage>,
}

/// From two evaluations on.
static METHODS: LazyLock<Vec<Method>> = LazyLock::new(|| (2..=MOST_STAGES).map(Method::new).collect());

impl Method {
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

/// A solution on its way.
pub(super) struct Chebyshev<F> {
    /// What is followed; its velocity was last asked for at the state.
    pub flow: F,
    /// The error of a step that is allowed, in each component.
    tolerance: f64,
    /// \[s\]
    pub time: f64,
    /// The next step \[s\].
    step: f64,
    /// By the law, and with what the last step has seen [1/s].
    law_rate: f64,
    rate: f64,
    steps: u32,
    /// The state, its velocity, and the same before the last step.
    pub state: Vec<f64>,
    pub velocity: Vec<f64>,
    pub velocity_before: Vec<f64>,
    /// The last two stages.
    stage: Vec<f64>,
    stage_before: Vec<f64>,
    slope: Vec<f64>,
}

impl<F: Flow> Chebyshev<F> {
    /// At `start` at time 0.
    pub fn new(mut flow: F, start: &[f64], tolerance: f64) -> Self {
        let mut velocity = vec![0.0; start.len()];
        flow.velocity(start, &mut velocity);
        let rate = flow.fastest_rate().max(SLOWEST);
        Self {
            tolerance,
            time: 0.0,
            step: 0.1 / rate,
            law_rate: rate,
            rate,
            steps: 0,
            state: start.to_vec(),
            velocity_before: velocity.clone(),
            stage: velocity.clone(),
            stage_before: velocity.clone(),
            slope: velocity.clone(),
            velocity,
            flow,
        }
    }

    /// A step, to `end` \[s\] at most; false where none is short enough.
    pub fn advance(&mut self, end: f64) -> bool {
        loop {
            let step = self.step.min(LONGEST / self.rate).min(end - self.time);
            let error = self.attempt(step);
            // The error of a step grows with its third power. What is not a number fails.
            let factor = if error.is_finite() { 0.8 / error.cbrt().max(0.1) } else { 0.1 };
            self.step = step * factor.max(0.1);
            if error <= 1.0 {
                self.accept(step, end);
                return true;
            }
            if self.time + self.step <= self.time {
                return false;
            }
        }
    }

    /// Tries a step of `step` \[s\], into `stage` and `slope`; its error in tolerances.
    fn attempt(&mut self, step: f64) -> f64 {
        let count = 1 + (1.0 + 1.54 * step * self.rate).sqrt() as usize;
        let Method { first, stages } = &METHODS[count.clamp(2, MOST_STAGES) - 2];
        self.stage_before.copy_from_slice(&self.state);
        for (i, slot) in self.stage.iter_mut().enumerate() {
            *slot = self.state[i] + first * step * self.velocity[i];
        }
        for Stage { mu, nu, mu_tilde, gamma_tilde } in stages {
            self.flow.velocity(&self.stage, &mut self.slope);
            for i in 0..self.state.len() {
                let change = step * (mu_tilde * self.slope[i] + gamma_tilde * self.velocity[i]);
                let next =
                    (1.0 - mu - nu) * self.state[i] + mu * self.stage[i] + nu * self.stage_before[i] + change;
                self.stage_before[i] = std::mem::replace(&mut self.stage[i], next);
            }
        }
        self.flow.velocity(&self.stage, &mut self.slope);
        let error = |i: usize| {
            let moved = self.stage[i] - self.state[i];
            (0.4 * step * (self.velocity[i] + self.slope[i]) - 0.8 * moved).abs() / self.tolerance
        };
        // Unlike max, a sum keeps what is not a number.
        (0..self.state.len()).map(|i| error(i).powi(2)).sum::<f64>().sqrt()
    }

    fn accept(&mut self, step: f64, end: f64) {
        let largest = |one: &[f64], other: &[f64]| {
            one.iter().zip(other).fold(0.0_f64, |most, (one, other)| most.max((one - other).abs()))
        };
        // The velocity may change faster than the law's rate says, as near a singularity.
        let moved = largest(&self.stage, &self.state);
        let changed = largest(&self.slope, &self.velocity);
        let secant = if moved > 0.0 { changed / moved } else { 0.0 };
        self.steps += 1;
        if self.steps.is_multiple_of(RATE_STEPS) {
            self.law_rate = self.flow.fastest_rate();
        }
        self.rate = 1.2 * self.law_rate.max(secant).max(SLOWEST);
        self.time = if step == end - self.time { end } else { self.time + step };
        std::mem::swap(&mut self.state, &mut self.stage);
        std::mem::swap(&mut self.velocity_before, &mut self.velocity);
        std::mem::swap(&mut self.velocity, &mut self.slope);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `ẋ = −λ (x − 1)` for two rates, and how often it was asked for.
    struct Decay {
        rates: [f64; 2],
        asked: usize,
    }

    impl Flow for Decay {
        fn velocity(&mut self, state: &[f64], velocity: &mut [f64]) {
            self.asked += 1;
            for ((slot, x), rate) in velocity.iter_mut().zip(state).zip(self.rates) {
                *slot = -rate * (x - 1.0);
            }
        }

        fn fastest_rate(&self) -> f64 {
            self.rates[0].max(self.rates[1])
        }
    }

    /// The largest error at the end of any step, and the number of evaluations.
    fn follow(rates: [f64; 2], tolerance: f64) -> (f64, usize) {
        let mut solution = Chebyshev::new(Decay { rates, asked: 0 }, &[0.0, 3.0], tolerance);
        let mut worst = 0.0_f64;
        while solution.time < 10.0 {
            assert!(solution.advance(10.0));
            for ((x, start), rate) in solution.state.iter().zip([0.0, 3.0]).zip(rates) {
                let exact = 1.0 + (start - 1.0) * (-rate * solution.time).exp();
                worst = worst.max((x - exact).abs());
            }
        }
        assert_eq!(solution.time, 10.0);
        (worst, solution.flow.asked)
    }

    #[test]
    fn it_is_of_second_order() {
        let (coarse, few) = follow([1.0, 2.0], 1e-5);
        let (fine, many) = follow([1.0, 2.0], 1e-8);
        assert!(coarse < 1e-3 && fine < 1e-5, "{coarse} {fine}");
        // Ten times as many steps are a hundred times as precise.
        let order = (coarse / fine).ln() / (many as f64 / few as f64).ln();
        assert!((1.7..2.5).contains(&order), "{order}");
    }

    #[test]
    fn fast_rates_cost_little() {
        let (error, asked) = follow([300.0, 1.0], 1e-5);
        assert!(error < 1e-3, "{error}");
        // A classical method of fourth order needs at least 4 · 10 · 300/2.8 = 4286.
        assert!(asked < 1500, "{asked}");
    }

    #[test]
    fn what_has_no_velocity_ends() {
        struct Nowhere;
        impl Flow for Nowhere {
            fn velocity(&mut self, _: &[f64], velocity: &mut [f64]) {
                velocity.fill(f64::NAN);
            }
            fn fastest_rate(&self) -> f64 {
                f64::NAN
            }
        }
        assert!(!Chebyshev::new(Nowhere, &[0.0], 1e-5).advance(1.0));
    }
}
