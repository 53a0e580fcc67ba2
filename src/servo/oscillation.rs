//! Whether the commands swing to and fro instead of bringing the arm to its goal.

use super::{GoalError, Tolerance};
use std::time::Duration;

/// Swings are counted over this time, and over the same time again.
const WINDOW: Duration = Duration::from_millis(900);

/// So many reversals of one joint in a window, and in the next, are an oscillation: 2.2 Hz and more.
const REVERSALS: u32 = 4;

/// A swing [rad/s] from one reversal to the next that counts where the error gets no smaller, and one that counts always.
const SWING: f64 = 0.05;
const LARGE_SWING: f64 = 0.5;

/// The error gets smaller if its largest value in a window is less than this part of that in the window before.
const SHRINKS: f64 = 0.8;

/// Watches the commands of a motion.
#[derive(Clone, Debug, Default)]
pub(super) struct Oscillation {
    joints: Vec<[Zigzag; 2]>,
    window: Option<Window>,
    before: Option<Verdict>,
}

/// What a window has seen so far.
#[derive(Clone, Copy, Debug)]
struct Window {
    began: Duration,
    worst_error: f64,
}

/// What a window has seen.
#[derive(Clone, Copy, Debug)]
struct Verdict {
    swings: bool,
    swings_largely: bool,
    worst_error: f64,
}

/// Counts the reversals of a number that goes up and down by more than a threshold.
#[derive(Clone, Copy, Debug, Default)]
struct Zigzag {
    rising: bool,
    extreme: f64,
    reversals: u32,
}

impl Zigzag {
    fn add(&mut self, value: f64, threshold: f64) {
        let sign = if self.rising { 1.0 } else { -1.0 };
        if sign * (value - self.extreme) >= 0.0 {
            self.extreme = value;
        } else if sign * (self.extreme - value) > threshold {
            (self.rising, self.extreme) = (!self.rising, value);
            self.reversals += 1;
        }
    }
}

impl Oscillation {
    /// Adds the `command` [rad/s] made at `now` with the goal at `error`: true where the arm has been oscillating, for two
    /// windows.
    pub fn update(
        &mut self,
        now: Duration,
        command: &[f64],
        error: &GoalError,
        tolerance: &Tolerance,
    ) -> bool {
        self.joints.resize(command.len(), Default::default());
        for ([small, large], speed) in self.joints.iter_mut().zip(command) {
            small.add(*speed, SWING);
            large.add(*speed, LARGE_SWING);
        }
        let relative = (error.position / tolerance.linear).max(error.rotation / tolerance.angular);
        let window = self.window.get_or_insert(Window { began: now, worst_error: relative });
        window.worst_error = window.worst_error.max(relative);
        if now.saturating_sub(window.began) < WINDOW {
            return false;
        }
        let worst_error = window.worst_error;
        self.window = None;
        let counts = |size: usize| self.joints.iter().any(|zigzags| zigzags[size].reversals >= REVERSALS);
        let verdict = Verdict { swings: counts(0), swings_largely: counts(1), worst_error };
        self.joints.iter_mut().flatten().for_each(|zigzag| zigzag.reversals = 0);
        self.before.replace(verdict).is_some_and(|before| before.goes_on(&verdict))
    }
}

impl Verdict {
    fn goes_on(&self, next: &Self) -> bool {
        let no_smaller = next.worst_error > SHRINKS * self.worst_error;
        (self.swings && next.swings && no_smaller) || (self.swings_largely && next.swings_largely)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TOLERANCE: Tolerance = Tolerance { linear: 1e-3, angular: 1e-2 };

    /// When it is seen, of a swing of this frequency [Hz] and amplitude [rad/s], the error shrinking by this rate [1/s].
    fn seen(frequency: f64, amplitude: f64, rate: f64) -> Option<f64> {
        let mut oscillation = Oscillation::default();
        (0..5000).find_map(|cycle| {
            let now = Duration::from_millis(2) * cycle;
            let time = now.as_secs_f64();
            let command = [0.0, amplitude * (std::f64::consts::TAU * frequency * time).sin() + 0.3];
            let error = GoalError { position: 0.1 * (-rate * time).exp(), rotation: 0.0 };
            oscillation.update(now, &command, &error, &TOLERANCE).then_some(time)
        })
    }

    #[test]
    fn swings_are_seen_within_3_s() {
        for (frequency, amplitude) in [(3.0, 0.05), (5.0, 2.5), (50.0, 0.05)] {
            assert!(seen(frequency, amplitude, 0.0).unwrap() < 3.0, "{frequency} Hz, {amplitude} rad/s");
        }
        assert!(seen(5.0, 2.5, 1.0).unwrap() < 3.0, "large ones also where the error shrinks");
    }

    #[test]
    fn what_is_small_slow_or_on_the_way_is_none() {
        assert_eq!(seen(5.0, 0.02, 0.0), None);
        assert_eq!(seen(1.0, 2.5, 0.0), None);
        assert_eq!(seen(5.0, 0.2, 1.0), None);
    }
}
