//! Limits how often something is done, such as a warning that is logged.

use std::time::Duration;

/// Allows an action at once, and then at most once per interval.
#[derive(Clone, Debug)]
pub(super) struct Throttle {
    interval: Duration,
    last: Option<Duration>,
}

impl Throttle {
    pub const fn new(interval: Duration) -> Self {
        Self { interval, last: None }
    }

    /// Returns true at the first call. Later returns true if, at `now`, the interval has passed since the last call that returned
    /// true.
    pub fn is_due(&mut self, now: Duration) -> bool {
        let is_due = self.last.is_none_or(|last| now.saturating_sub(last) >= self.interval);
        if is_due {
            self.last = Some(now);
        }
        is_due
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_event_passes_at_once_and_then_one_per_interval() {
        let mut throttle = Throttle::new(Duration::from_millis(100));
        let passed = (5..=305).filter(|ms| throttle.is_due(Duration::from_millis(*ms)));
        assert_eq!(passed.collect::<Vec<_>>(), [5, 105, 205, 305]);
    }
}
