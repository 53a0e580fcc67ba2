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

    /// Predicts the error at which the arm comes to rest: the present error plus its change during the last `time` \[s\]. `log` is
    /// the screw log of the error at `now`.
    ///
    /// If the error decays exponentially to 0 with the time constant `time`, the change exceeds the present error. The prediction then
    /// overshoots 0: it is `1 − (e − 1) = −0.72` times the present error. So it is within the tolerances if the present error is.
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
