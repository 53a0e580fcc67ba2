//! Detects joint states that arrive too rarely for the timeout.

use serde::{Deserialize, Serialize};
use std::time::Duration;

/// The median of this many intervals counts. An outage is a single long interval and does not change the median.
const KEPT: usize = 5;

/// Joint states are too rare if their interval exceeds this fraction of the timeout: with jitter, some of them then arrive too
/// late.
const LARGEST_PART: f64 = 0.8;

/// The latest intervals of joint states.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Rarity {
    intervals: [Duration; KEPT],
    heard: usize,
    /// The interval at which joint states became too rare; `None` if they are not.
    pub interval: Option<Duration>,
}

impl Rarity {
    /// Notes the `interval` since the last joint state.
    pub fn hear(&mut self, interval: Duration, timeout: Duration) {
        self.intervals[self.heard % KEPT] = interval;
        self.heard = (self.heard + 1) % KEPT;
        let mut sorted = self.intervals;
        sorted.sort();
        let median = sorted[KEPT / 2];
        let is_rare = median > timeout.mul_f64(LARGEST_PART);
        self.interval = is_rare.then(|| self.interval.unwrap_or(median));
    }
}
