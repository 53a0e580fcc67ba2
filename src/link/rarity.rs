//! Detects joint states that arrive too rarely for the timeout.

use serde::{Deserialize, Serialize};
use std::time::Duration;

/// The number of latest intervals. Their median decides whether joint states are too rare. An outage is a single long interval, which
/// hardly changes the median.
const KEPT: usize = 5;

/// Joint states are too rare if their interval exceeds this fraction of the timeout. Because of jitter, some of them would then
/// arrive after the timeout.
const LARGEST_PART: f64 = 0.8;

/// The latest intervals of joint states.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Rarity {
    intervals: [Duration; KEPT],
    heard: usize,
    /// The median interval of joint states when they became too rare; `None` while they are not too rare.
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
