//! What is said again and again: how often, and when it is new.

use dq_ros::ros::Logger;
use std::time::Duration;

/// Whether `interval` has passed since `last`, which then becomes `now`.
pub(super) fn due(last: &mut Duration, now: Duration, interval: Duration) -> bool {
    let due = now.saturating_sub(*last) >= interval;
    if due {
        *last = now;
    }
    due
}

/// A complaint as it was logged last; none where there is no reason for it.
#[derive(Default)]
pub(super) struct Complaint(Option<String>);

impl Complaint {
    /// Warns of it where it is another one than before.
    pub fn warn(&mut self, log: &Logger, now: Option<String>) {
        if now != self.0 {
            now.iter().for_each(|warning| log.warn(warning));
            self.0 = now;
        }
    }
}
