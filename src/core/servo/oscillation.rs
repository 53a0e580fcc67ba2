//! Detects that the commands oscillate instead of moving the arm to its goal.
//!
//! A sound motion may reverse, too: a joint may change its direction about ten times within two seconds. So reversals count as an
//! oscillation only if they are frequent, or if the law's own error reverses with them. A sound motion only reduces that error.
//!
//! A moving goal also makes commands and errors reverse. So the monitor ignores the part of the error's change that comes directly
//! from a change of the goal. Each change of the goal also allows every joint two more reversals, there and back.

use serde::{Deserialize, Serialize};
use std::time::Duration;

/// The length of the window in which reversals are counted. The commands count as oscillating only if two successive windows show
/// an oscillation.
const WINDOW: Duration = Duration::from_millis(900);

/// If one joint reverses this many times per window, the commands oscillate, even if the law's error does not reverse. This is 4.4
/// Hz. A joint in a sound motion reverses less often.
const MANY: u32 = 8;

/// If the law's error reverses this many times per window, and some joint reverses at least [`FEW`] times, the commands oscillate.
/// The error of a sound motion reverses less often.
const ERROR_REVERSALS: u32 = 3;

/// See [`ERROR_REVERSALS`]: the least number of reversals of a joint per window.
const FEW: u32 = 2;

/// A joint's speed counts as reversed if it has changed by more than this since its last extreme [rad/s, prismatic: m/s]. Such reversals
/// count as an oscillation only if the error does not shrink.
const SWING: f64 = 0.05;
/// Like [`SWING`], for larger reversals. They count as an oscillation even if the error shrinks.
const LARGE_SWING: f64 = 0.5;

/// A reversal of the law's error counts if the error's natural logarithm has changed by more than this since its last extreme. This
/// is a change of the error by about 5 %.
const ERROR_SWING: f64 = 0.05;

/// A change of the error counts only if it exceeds this factor times the change that a moving goal typically causes. The factor
/// allows for the delay with which the arm follows the goal.
const CHANGES: f64 = 2.0;

/// The weight of the newest value in [`Oscillation::change`], a running average.
const MEMORY: f64 = 0.2;

/// Number of reversals of a joint that one change of the goal may cause.
const TURNS: u32 = 2;

/// The error counts as shrinking if its largest value in a window is below this factor times its largest value in the previous
/// window.
const SHRINKS: f64 = 0.8;

/// Monitors the commands of a motion.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct Oscillation {
    joints: Vec<[Zigzag; 2]>,
    error: Zigzag,
    /// The running average of the size of the error's change when the goal changes.
    change: f64,
    /// Number of changes of the goal in the window.
    changes: u32,
    window: Option<Window>,
    before: Option<Verdict>,
}

/// The window in progress.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Window {
    began: Duration,
    worst_error: f64,
}

/// The result of one window: whether the commands oscillated, and the largest error.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Verdict {
    swings: bool,
    swings_largely: bool,
    worst_error: f64,
}

/// Counts the reversals of a number. A reversal counts if the number has changed by more than a threshold since the last extreme.
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

    /// Returns the number of reversals, and resets it to 0.
    fn take(&mut self) -> u32 {
        std::mem::take(&mut self.reversals)
    }
}

impl Oscillation {
    /// Forgets all commands and errors so far. Allocates nothing.
    pub fn restart(&mut self) {
        self.joints.clear();
        *self = Self { joints: std::mem::take(&mut self.joints), ..Self::default() };
    }

    /// Notes that a change of the goal has changed the law's own error from `before` to `after`.
    pub fn goal_moved(&mut self, before: f64, after: f64) {
        self.error.extreme += logarithm(after) - logarithm(before);
        self.change += MEMORY * ((after - before).abs() - self.change);
        self.changes += 1;
    }

    /// Adds the `command` [rad/s, prismatic: m/s] at `now`; `error` is the size of the law's own error. Returns whether the arm has
    /// oscillated in two successive windows.
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

    /// Ends a window, and returns its result.
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

/// Returns the logarithm of an error. It is finite even for an error of 0.
fn logarithm(error: f64) -> f64 {
    error.max(f64::MIN_POSITIVE).ln()
}

impl Verdict {
    fn goes_on(&self, next: &Self) -> bool {
        let no_smaller = next.worst_error > SHRINKS * self.worst_error;
        (self.swings && next.swings && no_smaller) || (self.swings_largely && next.swings_largely)
    }
}
