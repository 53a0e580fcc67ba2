//! Judges recorded commands: when they were made, and whether they hold what every command must.

use crate::nodes::CycleLabel;
use crate::servo::{Invariants, Limits, Violation};
use std::time::Duration;

/// Follows the commands of one servo.
pub(super) struct Judge {
    period: Duration,
    /// When the last cycle was.
    cycle: Option<Duration>,
    invariants: Invariants,
    /// Of the last command.
    label: Option<CycleLabel>,
    goals_before_stop: u64,
}

impl Judge {
    /// For the commands of a cycle of `period` under `limits`.
    pub fn new(limits: Limits, period: Duration) -> Self {
        let invariants = Invariants::new(limits, period);
        Self { period, cycle: None, invariants, label: None, goals_before_stop: 0 }
    }

    /// Goes on with other limits.
    pub fn set_limits(&mut self, limits: Limits) {
        self.invariants.set_limits(limits);
    }

    /// How much longer than its period the cycle at `now` has taken \[ms\].
    pub fn jitter(&mut self, now: Duration) -> Option<f64> {
        let taken = now.saturating_sub(self.cycle.replace(now)?);
        Some(1e3 * (taken.as_secs_f64() - self.period.as_secs_f64()))
    }

    /// Checks a command [rad/s]. The servo has reason to stand while it is paused, and until a goal has come since its start or
    /// since it was stopped.
    ///
    /// # Errors
    /// What it breaks.
    pub fn check(&mut self, command: &[f64], label: CycleLabel) -> Result<(), Violation> {
        if self.label.as_ref().is_some_and(|last| label.stops > last.stops) {
            self.goals_before_stop = label.goals;
        }
        let standing = label.paused || label.goals <= self.goals_before_stop;
        let now = label.now;
        self.label = Some(label);
        self.invariants.check(now, command, standing)
    }
}
