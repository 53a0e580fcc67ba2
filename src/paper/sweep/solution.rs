//! A system of differential equations that is followed in steps as long as an error allows.

/// A system `ẋ = v(x)`.
pub(super) trait Flow {
    /// Writes v at `state`.
    fn velocity(&mut self, state: &[f64], velocity: &mut [f64]);

    /// The fastest rate of decay where the velocity was last asked for [1/s].
    fn fastest_rate(&self) -> f64;
}

/// A state and its velocity.
#[derive(Clone, Debug)]
pub(super) struct Point {
    pub state: Vec<f64>,
    pub velocity: Vec<f64>,
}

/// The velocity of number `i` at that part of a step of `step` \[s\], on the parabola of both ends' velocities and the way between them.
pub(super) fn speed_between([from, to]: [&Point; 2], step: f64, part: f64, i: usize) -> f64 {
    let (a, b) = (from.velocity[i], to.velocity[i]);
    let mean = (to.state[i] - from.state[i]) / step;
    a + part * (b - a) + 6.0 * part * (1.0 - part) * (mean - 0.5 * (a + b))
}

/// A way to make a step.
pub(super) trait Method: Sized {
    /// The error of a step grows with this power of its length.
    const ERROR_POWER: f64;

    /// A step turns so little that its ends, and those of this many equal parts, show what happens in it.
    const PARTS: u32;

    /// The error of a step that is allowed in each joint \[rad\].
    const TOLERANCE: f64;

    /// For states of so many numbers, at a place with this fastest rate [1/s], with the error of a step that is allowed in each.
    fn new(size: usize, rate: f64, tolerance: f64) -> Self;

    /// The longest step that is stable \[s\].
    fn longest(&self) -> f64;

    /// Makes the step of `step` \[s\] from one point to the other, which is written, and writes into `error` by how many times what is
    /// allowed it may be wrong. The velocity of the other point is the last that is asked for.
    fn attempt(&mut self, flow: &mut impl Flow, step: f64, ends: (&Point, &mut Point), error: &mut [f64]);

    /// The step between these points is taken; what keeps nothing of it does nothing.
    fn accepted(&mut self, _flow: &impl Flow, _from: &Point, _to: &Point) {}
}

/// What is slower than this [1/s] is no rate to choose a step by.
pub(super) const SLOWEST: f64 = 1e-3;

/// A solution on its way.
pub(super) struct Solution<F, M> {
    /// What is followed; its velocity was last asked for at the state.
    pub flow: F,
    method: M,
    /// \[s\]
    pub time: f64,
    /// The next step \[s\].
    step: f64,
    /// Where it is, and where it was before the last step.
    pub now: Point,
    pub before: Point,
    error: Vec<f64>,
}

impl<F: Flow, M: Method> Solution<F, M> {
    /// At `start` at time 0.
    pub fn new(mut flow: F, start: &[f64], tolerance: f64) -> Self {
        let mut velocity = vec![0.0; start.len()];
        flow.velocity(start, &mut velocity);
        let rate = flow.fastest_rate().max(SLOWEST);
        let now = Point { state: start.to_vec(), velocity };
        Self {
            method: M::new(start.len(), rate, tolerance),
            time: 0.0,
            step: 0.1 / rate,
            before: now.clone(),
            now,
            error: vec![0.0; start.len()],
            flow,
        }
    }

    /// A step, to `end` \[s\] at most; false where none is short enough.
    pub fn advance(&mut self, end: f64) -> bool {
        loop {
            let step = self.step.min(self.method.longest()).min(end - self.time);
            // The point before is no longer needed: the step is tried there.
            self.method.attempt(&mut self.flow, step, (&self.now, &mut self.before), &mut self.error);
            // Unlike max, a sum keeps what is not a number.
            let error = self.error.iter().map(|error| error * error).sum::<f64>().sqrt();
            // What is not a number fails.
            let grown = error.powf(1.0 / M::ERROR_POWER).max(0.1);
            self.step = step * if error.is_finite() { (0.8 / grown).max(0.1) } else { 0.1 };
            if error <= 1.0 {
                self.time = if step == end - self.time { end } else { self.time + step };
                std::mem::swap(&mut self.now, &mut self.before);
                self.method.accepted(&self.flow, &self.before, &self.now);
                return true;
            }
            if self.time + self.step <= self.time {
                return false;
            }
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
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
    pub fn follow<M: Method>(rates: [f64; 2], tolerance: f64) -> (f64, usize) {
        let mut solution = Solution::<_, M>::new(Decay { rates, asked: 0 }, &[0.0, 3.0], tolerance);
        let mut worst = 0.0_f64;
        while solution.time < 10.0 {
            assert!(solution.advance(10.0));
            for ((x, start), rate) in solution.now.state.iter().zip([0.0, 3.0]).zip(rates) {
                let exact = 1.0 + (start - 1.0) * (-rate * solution.time).exp();
                worst = worst.max((x - exact).abs());
            }
        }
        assert_eq!(solution.time, 10.0);
        (worst, solution.flow.asked)
    }

    /// The power of the number of evaluations by which the error shrinks from one tolerance to the other.
    pub fn order<M: Method>(tolerances: [f64; 2]) -> f64 {
        let [(coarse, few), (fine, many)] = tolerances.map(|tolerance| follow::<M>([1.0, 2.0], tolerance));
        (coarse / fine).ln() / (many as f64 / few as f64).ln()
    }

    /// Whether a system without a velocity is followed.
    pub fn advances_nowhere<M: Method>() -> bool {
        struct Nowhere;
        impl Flow for Nowhere {
            fn velocity(&mut self, _: &[f64], velocity: &mut [f64]) {
                velocity.fill(f64::NAN);
            }
            fn fastest_rate(&self) -> f64 {
                f64::NAN
            }
        }
        Solution::<_, M>::new(Nowhere, &[0.0], 1e-5).advance(1.0)
    }
}
