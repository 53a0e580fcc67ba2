//! Whether the commands swing to and fro instead of bringing the arm to its goal.
//!
//! A sound motion swings too: a joint may turn round some ten times in two seconds on its way. So swings count where they are many,
//! or where the law's own error, which a sound motion only reduces, swings with them.
//!
//! A goal that moves makes commands and errors swing, too. What it changes of the error at once is not the arm's doing, and each such change
//! may turn a joint round twice: there and back.

use serde::{Deserialize, Serialize};
use std::time::Duration;

/// Swings are counted over this time, and over the same time again.
const WINDOW: Duration = Duration::from_millis(900);

/// So many reversals of one joint in a window are more than a sound motion has: 4.4 Hz and more.
const MANY: u32 = 8;

/// So many reversals of the law's error in a window are more than a sound motion has, if some joint reverses with them.
const ERROR_REVERSALS: u32 = 3;

/// A joint reverses with the error if it does so this often in the window.
const FEW: u32 = 2;

/// A swing of a joint [rad/s] from one reversal to the next that counts where the error gets no smaller, and one that counts always.
const SWING: f64 = 0.05;
const LARGE_SWING: f64 = 0.5;

/// A swing of the error's logarithm that counts: by a twentieth of itself.
const ERROR_SWING: f64 = 0.05;

/// A swing of the error that counts is larger than this many typical changes by the goal, which delays let the arm follow too late.
const CHANGES: f64 = 2.0;

/// How much one change adds to what is typical.
const MEMORY: f64 = 0.2;

/// A change of the goal may turn a joint round this often.
const TURNS: u32 = 2;

/// The error gets smaller if its largest value in a window is less than this part of that in the window before.
const SHRINKS: f64 = 0.8;

/// Watches the commands of a motion.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct Oscillation {
    joints: Vec<[Zigzag; 2]>,
    error: Zigzag,
    /// The typical change of the error by a change of the goal.
    change: f64,
    /// Changes of the goal in the window.
    changes: u32,
    window: Option<Window>,
    before: Option<Verdict>,
}

/// What a window has seen so far.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Window {
    began: Duration,
    worst_error: f64,
}

/// What a window has seen.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Verdict {
    swings: bool,
    swings_largely: bool,
    worst_error: f64,
}

/// Counts the reversals of a number that goes up and down by more than a threshold.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
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

    /// How many reversals there were; they are counted from 0 again.
    fn take(&mut self) -> u32 {
        std::mem::take(&mut self.reversals)
    }
}

impl Oscillation {
    /// Begins anew, in the memory that there is.
    pub fn restart(&mut self) {
        self.joints.clear();
        *self = Self { joints: std::mem::take(&mut self.joints), ..Self::default() };
    }

    /// The goal has moved, which has changed the law's own error `before` to that `after`.
    pub fn goal_moved(&mut self, before: f64, after: f64) {
        self.error.extreme += logarithm(after) - logarithm(before);
        self.change += MEMORY * ((after - before).abs() - self.change);
        self.changes += 1;
    }

    /// Adds the `command` [rad/s] made at `now` with the law's own error of this size: true where the arm has been oscillating, for two
    /// windows.
    pub fn update(&mut self, now: Duration, command: &[f64], error: f64) -> bool {
        self.joints.resize(command.len(), Default::default());
        for ([small, large], speed) in self.joints.iter_mut().zip(command) {
            small.add(*speed, SWING);
            large.add(*speed, LARGE_SWING);
        }
        let log = logarithm(error);
        self.error.add(log, ERROR_SWING + CHANGES * self.change / log.exp());
        let window = self.window.get_or_insert(Window { began: now, worst_error: error });
        window.worst_error = window.worst_error.max(error);
        if now.saturating_sub(window.began) < WINDOW {
            return false;
        }
        let worst_error = window.worst_error;
        self.window = None;
        let verdict = self.verdict(worst_error);
        self.before.replace(verdict).is_some_and(|before| before.goes_on(&verdict))
    }

    /// Of a window that is over.
    fn verdict(&mut self, worst_error: f64) -> Verdict {
        let many = MANY + TURNS * std::mem::take(&mut self.changes);
        let most = self
            .joints
            .iter_mut()
            .fold([0, 0], |[small, large], [one, other]| [one.take().max(small), other.take().max(large)]);
        let error_swings = self.error.take() >= ERROR_REVERSALS && most[0] >= FEW;
        Verdict { swings: most[0] >= many || error_swings, swings_largely: most[1] >= many, worst_error }
    }
}

/// The logarithm of an error, which may be 0.
fn logarithm(error: f64) -> f64 {
    error.max(f64::MIN_POSITIVE).ln()
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
    use std::f64::consts::TAU;

    /// When it is seen, of a swing of this frequency [Hz] and amplitude [rad/s], the error swinging by this part of itself and shrinking
    /// by this rate [1/s].
    fn seen(frequency: f64, amplitude: f64, part: f64, rate: f64) -> Option<f64> {
        let mut oscillation = Oscillation::default();
        (0..5000).find_map(|cycle| {
            let now = Duration::from_millis(2) * cycle;
            let time = now.as_secs_f64();
            let swing = (TAU * frequency * time).sin();
            let command = [0.0, amplitude * swing + 0.3];
            let error = 0.1 * (1.0 + part * swing) * (-rate * time).exp();
            oscillation.update(now, &command, error).then_some(time)
        })
    }

    #[test]
    fn swings_are_seen_within_3_s() {
        for (frequency, amplitude, part) in [(3.0, 0.05, 0.1), (5.0, 2.5, 0.0), (50.0, 0.05, 0.0)] {
            assert!(
                seen(frequency, amplitude, part, 0.0).unwrap() < 3.0,
                "{frequency} Hz, {amplitude} rad/s"
            );
        }
        assert!(seen(5.0, 2.5, 0.0, 1.0).unwrap() < 3.0, "large ones also where the error shrinks");
    }

    #[test]
    fn what_is_small_slow_or_on_the_way_is_none() {
        assert_eq!(seen(5.0, 0.02, 0.0, 0.0), None);
        assert_eq!(seen(1.0, 2.5, 0.5, 0.0), None);
        assert_eq!(seen(3.0, 2.5, 0.0, 0.0), None, "the error does not swing");
        assert_eq!(seen(3.0, 2.5, 0.1, 1.0), None, "the error shrinks");
        assert_eq!(seen(5.0, 0.2, 0.0, 1.0), None);
    }
}
