//! The recent lateness of control cycles and joint states. Recent lateness may happen again at any time.

use serde::{Deserialize, Serialize};
use std::time::Duration;

/// The length of a window. A lateness is remembered for at least one window, and for at most two windows.
const WINDOW: Duration = Duration::from_secs(2);

/// The largest lateness that counts. Robots with a command timeout stop about this long after the last command, so a longer lateness
/// has no further effect.
pub(crate) const LONGEST_HOLD: Duration = Duration::from_millis(100);

/// The weight of the newest cycle in the average time between cycles. With this weight, the average covers about fifty cycles,
/// because a stop takes about this many cycles.
const SMOOTHING: f64 = 0.02;

/// The recent lateness of the cycles: the largest lateness of a single cycle, and the largest lateness averaged over the number of
/// cycles that a stop takes.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Cycles {
    period: Duration,
    last: Option<Duration>,
    /// Average time between cycles \[s\].
    average: f64,
    latest: Lateness,
    slowest: Lateness,
    /// Whether the last cycle was so late that the robot has stopped because of its command timeout.
    gap: bool,
}

impl Cycles {
    /// Creates the statistics of cycles with this `period`.
    pub fn new(period: Duration) -> Self {
        let (latest, slowest) = (Lateness::default(), Lateness::default());
        Self { period, last: None, average: period.as_secs_f64(), latest, slowest, gap: false }
    }

    /// Adds a cycle at `now`.
    pub fn note(&mut self, now: Duration) {
        let passed = self.last.replace(now).map_or(self.period, |last| now.saturating_sub(last));
        self.gap = passed > self.period + LONGEST_HOLD;
        let bounded = passed.min(self.period + LONGEST_HOLD).as_secs_f64();
        self.average += SMOOTHING * (bounded - self.average);
        self.latest.note(now, passed.saturating_sub(self.period));
        let average = Duration::try_from_secs_f64(self.average).unwrap_or(self.period);
        self.slowest.note(now, average.saturating_sub(self.period));
    }

    /// Returns whether the last cycle was so late that the robot has stopped because of its command timeout.
    pub fn has_gap(&self) -> bool {
        self.gap
    }

    /// Returns the largest lateness of a cycle in the last 2 to 4 s.
    pub fn latest(&self) -> Duration {
        self.latest.worst()
    }

    /// Returns the largest average time between cycles in the last 2 to 4 s. Each average covers about as many cycles as a stop takes.
    pub fn slowest(&self) -> Duration {
        self.period + self.slowest.worst()
    }
}

/// The largest lateness of cycles or joint states in the last 2 to 4 s: in the current window of 2 s and in the previous one.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Lateness {
    /// When the current window began.
    since: Duration,
    /// The largest lateness in the previous window.
    before: Duration,
    /// The largest lateness in the current window so far.
    now: Duration,
}

impl Lateness {
    /// Adds an event at `now` that is late by `late`.
    pub fn note(&mut self, now: Duration, late: Duration) {
        let passed = now.saturating_sub(self.since);
        if passed >= WINDOW {
            self.before = if passed < 2 * WINDOW { self.now } else { Duration::ZERO };
            (self.since, self.now) = (now, Duration::ZERO);
        }
        self.now = self.now.max(late.min(LONGEST_HOLD));
    }

    /// Returns the largest lateness in both windows.
    pub fn worst(&self) -> Duration {
        self.before.max(self.now)
    }
}
