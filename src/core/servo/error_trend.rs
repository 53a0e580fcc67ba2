//! The trend of an error. The trend shows whether an arm within its tolerances stays there or passes through.

use dq_algebra::UnitDualQuaternion;
use nalgebra::Vector6;
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// Number of errors that are kept.
const KEPT: usize = 32;
/// The time between two errors that are kept.
const SPACING: Duration = Duration::from_millis(30);

/// The recent errors of a motion to one goal.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(super) struct ErrorTrend {
    /// The time \[s\] and the screw log of each error.
    errors: [(f64, Vector6<f64>); KEPT],
    /// Number of errors added so far.
    count: usize,
}

impl ErrorTrend {
    /// Clears the errors, because the goal has changed.
    pub fn restart(&mut self) {
        self.count = 0;
    }

    /// Adds an error at `now`; `log` is its screw log.
    pub fn note(&mut self, now: Duration, log: &Vector6<f64>) {
        let now = now.as_secs_f64();
        let is_due = self.count == 0 || now - self.errors[(self.count - 1) % KEPT].0 >= SPACING.as_secs_f64();
        if is_due {
            self.errors[self.count % KEPT] = (now, *log);
            self.count += 1;
        }
    }

    /// Predicts the error at which the arm comes to rest: the error at `now`, whose screw log is `log`, plus its change in the last
    /// `time` \[s\]. For an error that decays to 0, the prediction has the opposite sign, but is smaller than the present error.
    pub fn leads_to(&self, now: Duration, log: &Vector6<f64>, time: f64) -> UnitDualQuaternion {
        let now = now.as_secs_f64();
        let kept = (self.count.saturating_sub(KEPT)..self.count).map(|number| &self.errors[number % KEPT]);
        let before = kept.rev().find(|(then, _)| now - then >= time);
        let before =
            before.or((self.count > 0).then(|| &self.errors[self.count.saturating_sub(KEPT) % KEPT]));
        let change =
            before.filter(|(then, _)| now > *then).map(|(then, error)| (log - error) * (time / (now - then)));
        UnitDualQuaternion::screw_exp(&(log + change.unwrap_or_default()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Yields, for every cycle from 1 s on, the error `of(time)` and the predicted error, in mm along x.
    fn leads(of: impl Fn(f64) -> f64) -> impl Iterator<Item = (f64, f64)> {
        let mut trend = ErrorTrend::default();
        (0..1500).filter_map(move |cycle| {
            let now = Duration::from_millis(2) * cycle;
            let log = Vector6::new(0.0, 0.0, 0.0, 1e-3 * of(now.as_secs_f64()), 0.0, 0.0);
            trend.note(now, &log);
            let there = trend.leads_to(now, &log, 0.25).translation().x;
            (now.as_secs_f64() >= 1.0).then_some((of(now.as_secs_f64()), 1e3 * there))
        })
    }

    #[test]
    fn an_error_that_decays_stays_inside() {
        assert!(leads(|time| 500.0 * (-4.0 * time).exp()).all(|(now, then)| then.abs() <= now.abs()));
    }

    #[test]
    fn an_error_that_passes_through_does_not_stay_inside() {
        for rest in [1.01, 1.2, 3.5, 70.0] {
            let passes = leads(|time| 500.0 * (-4.0 * time).exp() - rest);
            assert!(passes.filter(|(now, _)| now.abs() <= 1.0).all(|(_, then)| then.abs() > 1.0), "{rest}");
        }
    }

    #[test]
    fn a_single_error_leads_to_itself() {
        let log = Vector6::new(0.0, 0.0, 0.0, 1e-3, 0.0, 0.0);
        let there = ErrorTrend::default().leads_to(Duration::ZERO, &log, 0.25);
        assert!((there.translation().x - 1e-3).abs() < 1e-12);
    }
}
