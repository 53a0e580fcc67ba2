//! Whether a motion still gets nearer to its goal.

use super::{GoalError, Tolerance};
use std::time::Duration;

/// In each `progress_timeout` an error has to shrink by this part of itself, so that a slow law which arrives is not given up: from
/// 0.5 m to 1 mm in 5 s each takes at most 3.5 h, and 1e-3/s, the gain of a very slow law, is twice as much.
const SHARE: f64 = 1.0 / 400.0;

/// The smallest errors of a motion so far, and since when.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Progress {
    position: f64,
    rotation: f64,
    since: Duration,
}

impl Progress {
    /// Begins at time `now` with `error`.
    pub fn begin(now: Duration, error: GoalError) -> Self {
        Self { position: error.position, rotation: error.rotation, since: now }
    }

    /// Adds the error at time `now`: how long ago a part of it that is not within its tolerance became smaller than ever before by
    /// [`SHARE`] of itself, or by its whole tolerance.
    pub fn update(&mut self, now: Duration, error: GoalError, tolerance: &Tolerance) -> Duration {
        let nearer = shrinks(&mut self.position, error.position, tolerance.linear);
        let turned = shrinks(&mut self.rotation, error.rotation, tolerance.angular);
        if nearer || turned {
            self.since = now;
        }
        now.saturating_sub(self.since)
    }
}

/// Whether the error has come that much below the smallest so far, which it then is. To arrive is progress, to move within the
/// tolerance is not.
fn shrinks(smallest: &mut f64, error: f64, tolerance: f64) -> bool {
    let outside = *smallest > tolerance;
    let shrinks = outside && error <= *smallest - tolerance.min(SHARE * *smallest);
    if shrinks {
        *smallest = error;
    }
    shrinks
}

#[cfg(test)]
mod tests {
    use super::*;

    const TOLERANCE: Tolerance = Tolerance { linear: 1e-3, angular: 1e-2 };

    /// How long the longest time without progress was over `seconds` with the position error `position` and a rotation that is met.
    fn longest(seconds: f64, position: impl Fn(f64) -> f64) -> f64 {
        let error = |time: f64| GoalError { position: position(time), rotation: 5e-3 - 1e-5 * time };
        let mut progress = Progress::begin(Duration::ZERO, error(0.0));
        let times = (0..).map(|cycle| 0.01 * f64::from(cycle)).take_while(|time| *time <= seconds);
        let without = times.filter(|time| position(*time) > TOLERANCE.linear).map(|time| {
            progress.update(Duration::from_secs_f64(time), error(time), &TOLERANCE).as_secs_f64()
        });
        without.fold(0.0, f64::max)
    }

    #[test]
    fn a_slow_law_that_arrives_makes_progress_all_the_way() {
        // Gains of 1 and 0.001 1/s; a linear speed of 0.3 mm/s.
        assert!(longest(10.0, |t| 0.5 * (-t).exp()) < 0.1);
        assert!(longest(7000.0, |t| 0.5 * (-0.001 * t).exp()) < 3.0);
        assert!(longest(2000.0, |t| 0.5 - 3e-4 * t) < 5.0);
    }

    #[test]
    fn creeping_is_no_progress() {
        // 10 µm in 5 s, a tenth of a metre from the goal: it would take half a day.
        assert!(longest(20.0, |t| 0.1 - 2e-6 * t) > 15.0);
        // Ever nearer to 20 mm from a goal that is out of reach.
        assert!(longest(20.0, |t| 0.02 + 0.5 * (-t).exp()) > 8.0);
        assert!(longest(400.0, |t| 0.02 + 0.1 / (1.0 + t)) > 10.0);
    }
}
