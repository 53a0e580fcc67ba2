//! Whether an arm that is inside the tolerances stays there, or passes through: where its error leads.

use dq_algebra::UnitDualQuaternion;
use nalgebra::Vector6;
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// So many errors are kept, so far apart.
const KEPT: usize = 32;
const SPACING: Duration = Duration::from_millis(30);

/// The last errors of a motion to one goal.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(super) struct ErrorTrend {
    /// When each was measured \[s\], and the screw log.
    errors: [(f64, Vector6<f64>); KEPT],
    /// How many were, and when the last one \[s\].
    count: usize,
}

impl ErrorTrend {
    /// Begins anew, as the goal is another.
    pub fn restart(&mut self) {
        self.count = 0;
    }

    /// Adds the screw log of the error at `now`.
    pub fn note(&mut self, now: Duration, log: &Vector6<f64>) {
        let now = now.as_secs_f64();
        let is_due = self.count == 0 || now - self.errors[(self.count - 1) % KEPT].0 >= SPACING.as_secs_f64();
        if is_due {
            self.errors[self.count % KEPT] = (now, *log);
            self.count += 1;
        }
    }

    /// The error in which the one of `now`, whose screw log this is, comes to rest if it has changed as one that decays in `time` \[s\]:
    /// what it has changed by in this time goes on once more. An error that decays to 0 passes that by less than it is now.
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

    /// Where the error `of` a time \[s\] leads at each time from 1 s on, in mm along x.
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
    fn one_that_passes_through_does_not() {
        for rest in [1.01, 1.2, 3.5, 70.0] {
            let passes = leads(|time| 500.0 * (-4.0 * time).exp() - rest);
            assert!(passes.filter(|(now, _)| now.abs() <= 1.0).all(|(_, then)| then.abs() > 1.0), "{rest}");
        }
    }

    #[test]
    fn one_that_has_just_begun_leads_nowhere() {
        let log = Vector6::new(0.0, 0.0, 0.0, 1e-3, 0.0, 0.0);
        let there = ErrorTrend::default().leads_to(Duration::ZERO, &log, 0.25);
        assert!((there.translation().x - 1e-3).abs() < 1e-12);
    }
}
