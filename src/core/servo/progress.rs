//! Monitors whether a motion still gets nearer to its goal.

use dq_metrics::{GoalError, Tolerance};
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// An error has to shrink by this fraction within each `progress_timeout`. The fraction is small, so that a slow law that arrives
/// does not stall. A timeout of 5 s allows 52 min from 0.5 m to 1 mm, and a gain of 0.003/s is enough. The drift of a redundant arm
/// under a payload changes its error by up to half of this fraction.
pub(super) const SHARE: f64 = 1.0 / 100.0;

/// The fraction by which an error has to shrink if the arm need not wait for a slow law, because there may be another path to its
/// goal.
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
    /// Starts without any error. An error counts as progress if it shrinks by the fraction `share`.
    pub fn new(share: f64) -> Self {
        let most = f64::INFINITY;
        Self { position: most, rotation: most, law: most, share, without: Duration::ZERO }
    }

    /// Adds the error of a cycle in which the arm was driven for the time `driven`. Returns how long it was driven since the last
    /// progress.
    ///
    /// An error outside its tolerance makes progress when it reaches a new minimum that is below the last minimum by the fraction
    /// `share` or by a whole tolerance. The law's own error counts, too: a law may trade position for rotation, and the path to a
    /// goal that differs only in rotation may begin with meters.
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

/// Returns whether `error` is below the `smallest` error so far by the fraction `share` of it or by `amount`. If so, stores `error`
/// as the smallest.
fn shrinks(smallest: &mut f64, error: f64, amount: f64, share: f64) -> bool {
    let first = smallest.is_infinite() && error.is_finite();
    let shrinks = first || (error < *smallest && error <= *smallest - amount.min(share * *smallest));
    if shrinks {
        *smallest = error;
    }
    shrinks
}

#[cfg(test)]
mod tests {
    use super::*;

    const TOLERANCE: Tolerance = Tolerance { linear: 1e-3, angular: 1e-2 };

    /// Returns the longest time without progress in a motion of `seconds`. `position` gives the position error at each time. The
    /// rotation error is within its tolerance.
    fn longest(seconds: f64, position: impl Fn(f64) -> f64) -> f64 {
        let error = |time: f64| GoalError { position: position(time), rotation: 5e-3 - 1e-5 * time };
        // The law's error is constant, so that only the position error counts.
        let mut progress = Progress::new(SHARE);
        let times = (0..).map(|cycle| 0.01 * f64::from(cycle)).take_while(|time| *time <= seconds);
        let without = times.filter(|time| position(*time) > TOLERANCE.linear).map(|time| {
            progress.update(Duration::from_millis(10), error(time), 0.0, &TOLERANCE).as_secs_f64()
        });
        without.fold(0.0, f64::max)
    }

    #[test]
    fn a_slow_law_that_arrives_makes_progress_all_the_way() {
        // Gains of 1 and 0.003 1/s, and a linear speed of 0.3 mm/s.
        assert!(longest(10.0, |t| 0.5 * (-t).exp()) < 0.1);
        assert!(longest(2400.0, |t| 0.5 * (-0.003 * t).exp()) < 4.0);
        assert!(longest(2000.0, |t| 0.5 - 3e-4 * t) < 5.0);
    }

    #[test]
    fn trading_one_error_for_the_other_is_progress_if_the_laws_error_shrinks() {
        let mut progress = Progress::new(SHARE);
        progress.update(Duration::ZERO, GoalError { position: 0.0, rotation: 0.4 }, 0.4, &TOLERANCE);
        for second in 1..30_u32 {
            let fading = (-0.2 * f64::from(second)).exp();
            let error = GoalError { position: 0.3 * fading, rotation: 5e-3 };
            let without = progress.update(Duration::from_secs(1), error, 0.35 * fading, &TOLERANCE);
            assert_eq!(without, Duration::ZERO);
        }
    }

    #[test]
    fn creeping_is_not_progress() {
        // 10 µm in 5 s, a tenth of a meter from the goal: it would take half a day.
        assert!(longest(20.0, |t| 0.1 - 2e-6 * t) > 15.0);
        // The error approaches 20 mm; the goal is out of reach.
        assert!(longest(20.0, |t| 0.02 + 0.5 * (-t).exp()) > 8.0);
        assert!(longest(400.0, |t| 0.02 + 0.1 / (1.0 + t)) > 10.0);
    }
}
