//! Limits how often a warning is repeated.

use dq_ros::ros::Logger;
use std::time::Duration;

/// Returns whether `interval` has passed since `last`; if so, sets `last` to `now`.
pub(super) fn due(last: &mut Duration, now: Duration, interval: Duration) -> bool {
    let due = now.saturating_sub(*last) >= interval;
    if due {
        *last = now;
    }
    due
}

/// The warning that was logged last; `None` if the last state needed no warning.
#[derive(Default)]
pub(super) struct WarningOnChange(Option<String>);

impl WarningOnChange {
    /// Logs the warning `now` if it differs from the last one.
    pub fn warn(&mut self, log: &Logger, now: Option<String>) {
        if now != self.0 {
            now.iter().for_each(|warning| log.warn(warning));
            self.0 = now;
        }
    }
}
