//! Whether a motion still gets nearer to its goal.

use super::{GoalError, Tolerance};
use std::time::Duration;

/// An error smaller than ever before by this part of its tolerance is progress. So a law that creeps is making progress as long
/// as it would arrive some day: 1 mm and 5 s allow 2 µm/s.
const QUANTUM: f64 = 0.01;

/// The smallest errors of a motion so far, and since when.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Progress {
    smallest: GoalError,
    since: Duration,
}

impl Progress {
    /// Begins at time `now` with `error`.
    pub fn begin(now: Duration, error: GoalError) -> Self {
        Self { smallest: error, since: now }
    }

    /// Adds the error at time `now`: how long ago either part of it was smaller than ever before.
    pub fn update(&mut self, now: Duration, error: GoalError, tolerance: &Tolerance) -> Duration {
        let nearer = error.position < self.smallest.position - QUANTUM * tolerance.linear;
        let turned = error.rotation < self.smallest.rotation - QUANTUM * tolerance.angular;
        if nearer {
            self.smallest.position = error.position;
        }
        if turned {
            self.smallest.rotation = error.rotation;
        }
        if nearer || turned {
            self.since = now;
        }
        now.saturating_sub(self.since)
    }
}
