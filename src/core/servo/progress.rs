//! Monitors whether a motion still gets nearer to its goal.

use dq_metrics::{GoalError, Tolerance};
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// An error has to shrink by this fraction within each `progress_timeout`. Otherwise the motion stalls.
///
/// The fraction is small, so that a slow law that still reaches the goal does not stall. With a timeout of 5 s, for example, an arm
/// with a gain of 0.003/s does not stall. Such an arm takes about half an hour to reduce its error from 0.5 m to 1 mm.
///
/// The fraction must not be smaller, because drift could then count as progress. Under a payload, a redundant arm drifts, and this
/// changes the error by up to half of the fraction.
pub(super) const SHARE: f64 = 1.0 / 100.0;

/// The fraction by which an error has to shrink within each `progress_timeout` if the arm may reach the goal by a reconfiguration
/// instead. The arm then need not wait for a slow law.
pub(super) const BRISK: f64 = 0.2;

/// The smallest errors of a motion so far, and how long the arm was driven since the last progress.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Progress {
    position: f64,
    rotation: f64,
    law: f64,
    /// The fraction by which an error has to shrink to count as progress.
    share: f64,
    without: Duration,
}

impl Progress {
    /// Starts without an error, so that the first error counts as progress. A later error counts as progress if it is smaller than
    /// the smallest error so far by the fraction `share`.
    pub fn new(share: f64) -> Self {
        let most = f64::INFINITY;
        Self { position: most, rotation: most, law: most, share, without: Duration::ZERO }
    }

    /// Adds the error of a cycle in which the arm was driven for the time `driven`. Returns how long the arm was driven since the
    /// last progress.
    ///
    /// There is progress if one of these errors falls far enough below its smallest value so far:
    ///
    /// - the position or the rotation error, if it was outside its tolerance: by the fraction `share` of that value, or by the
    ///   tolerance if this is less,
    /// - the law's own error: by the fraction `share` of that value. It counts because a law may trade position for rotation: even
    ///   if the goal differs only in rotation, the tool may first move meters away.
    pub fn update(
        &mut self,
        driven: Duration,
        error: GoalError,
        law: f64,
        tolerance: &Tolerance,
    ) -> Duration {
        let Self { position, rotation, law: law_error, share, .. } = self;
        let shrinks = |smallest: &mut f64, error, amount| shrinks(smallest, error, amount, *share);
        let nearer = *position > tolerance.linear && shrinks(position, error.position, tolerance.linear);
        let turned = *rotation > tolerance.angular && shrinks(rotation, error.rotation, tolerance.angular);
        let lawful = shrinks(law_error, law, f64::INFINITY);
        self.without = if nearer || turned || lawful { Duration::ZERO } else { self.without + driven };
        self.without
    }
}

/// Returns whether `error` is below the `smallest` error so far by `amount`, or by the fraction `share` of the smallest error. If
/// so, stores `error` as the smallest.
fn shrinks(smallest: &mut f64, error: f64, amount: f64, share: f64) -> bool {
    let first = smallest.is_infinite() && error.is_finite();
    let shrinks = first || (error < *smallest && error <= *smallest - amount.min(share * *smallest));
    if shrinks {
        *smallest = error;
    }
    shrinks
}
