//! By how much what should come once a period came too late in the last seconds: it may again.

use serde::{Deserialize, Serialize};
use std::time::Duration;

/// What came late is forgotten after once to twice this time.
const WINDOW: Duration = Duration::from_secs(2);

/// No robot is expected to obey a command for longer without another, so that nothing later matters.
pub(crate) const LONGEST_HOLD: Duration = Duration::from_millis(100);

/// So much of each cycle's time goes into what cycles take on average: that of the fifty or so that a stop takes.
const SMOOTHING: f64 = 0.02;

/// How late the cycles of the last seconds were: the latest, and what the slowest stop had of them.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Cycles {
    period: Duration,
    last: Option<Duration>,
    /// From one to the next on average \[s\].
    average: f64,
    latest: Lateness,
    slowest: Lateness,
    /// Whether the last one came so late that no robot obeyed until then.
    gap: bool,
}

impl Cycles {
    /// Of a cycle of `period`.
    pub fn new(period: Duration) -> Self {
        let (latest, slowest) = (Lateness::default(), Lateness::default());
        Self { period, last: None, average: period.as_secs_f64(), latest, slowest, gap: false }
    }

    /// Notes a cycle at `now`.
    pub fn note(&mut self, now: Duration) {
        let passed = self.last.replace(now).map_or(self.period, |last| now.saturating_sub(last));
        self.gap = passed > self.period + LONGEST_HOLD;
        let bounded = passed.min(self.period + LONGEST_HOLD).as_secs_f64();
        self.average += SMOOTHING * (bounded - self.average);
        self.latest.note(now, passed.saturating_sub(self.period));
        let average = Duration::try_from_secs_f64(self.average).unwrap_or(self.period);
        self.slowest.note(now, average.saturating_sub(self.period));
    }

    /// Whether the last one came so late that no robot obeyed the command before until then.
    pub fn has_gap(&self) -> bool {
        self.gap
    }

    /// By how much the latest of the last seconds was.
    pub fn latest(&self) -> Duration {
        self.latest.worst()
    }

    /// From one to the next, as the slowest stop of the last seconds would have had them.
    pub fn slowest(&self) -> Duration {
        self.period + self.slowest.worst()
    }
}

/// The worst of the last seconds.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Lateness {
    /// Since when the newer of the two windows lasts.
    since: Duration,
    before: Duration,
    now: Duration,
}

impl Lateness {
    /// Notes at `now` what comes `late`.
    pub fn note(&mut self, now: Duration, late: Duration) {
        let passed = now.saturating_sub(self.since);
        if passed >= WINDOW {
            self.before = if passed < 2 * WINDOW { self.now } else { Duration::ZERO };
            (self.since, self.now) = (now, Duration::ZERO);
        }
        self.now = self.now.max(late.min(LONGEST_HOLD));
    }

    /// The latest of the last seconds.
    pub fn worst(&self) -> Duration {
        self.before.max(self.now)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_worst_is_bounded_and_forgotten() {
        let ms = Duration::from_millis;
        let mut lateness = Lateness::default();
        lateness.note(ms(1000), ms(30));
        lateness.note(ms(1010), ms(20));
        lateness.note(ms(2999), ms(5));
        assert_eq!(lateness.worst(), ms(30));
        lateness.note(ms(3999), ms(7));
        assert_eq!(lateness.worst(), ms(30), "of the window before");
        lateness.note(ms(5000), ms(0));
        assert_eq!(lateness.worst(), ms(7));
        lateness.note(ms(60_000), ms(500));
        assert_eq!(lateness.worst(), LONGEST_HOLD);
        lateness.note(ms(120_000), ms(1));
        assert_eq!(lateness.worst(), ms(1));
    }
}
