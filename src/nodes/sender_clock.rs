//! Computes the age of messages by their senders' clocks, which may be wrong.
//!
//! A single message does not show whether it is late or the sender's clock is behind. So this module assumes that the clocks agree
//! until the sender's own messages show that they do not. From then on, the age of a message is its delay relative to the sender's
//! fastest messages.
//!
//! A wrong clock makes ages less exact. If the publisher is older than this node, and its clock is behind, the servo may at first
//! reject its messages as late. The reason for the rejection names the apparent age. The rejections end once two messages that
//! arrive at least 0.1 s apart have the same offset, up to `JITTER`.

use std::time::Duration;

/// The largest possible age of a message \[ns\]. If the [offset](Arrival::offset) of a message is larger, the clocks do not agree.
///
/// A message becomes old while its writer keeps it for an unreachable reader. The writer drops the reader after a lease of 50 s (nodes
/// of this program), 10 s (Cyclone DDS) or 20 s (Fast DDS). `KEPT` is several times as long.
const KEPT: i64 = 300_000_000_000;

/// The limits of the drift between two clocks. In the time t after the sender's fastest message, the clocks drift apart by at most
/// `DRIFT` · t. Clocks that are synchronized do not drift farther apart than `MOST_DRIFT` \[ns\], however long t is. A message whose
/// apparent delay is within this drift counts as undelayed.
const DRIFT: f64 = 2e-4;
const MOST_DRIFT: f64 = 1e8;

/// Two messages count as undelayed if they arrive at least `APART` apart and if their [offsets](Arrival::offset) differ by at most
/// `JITTER` \[ns\]. The times of arrival matter because messages that were held up together arrive in a burst.
const APART: Duration = Duration::from_millis(100);
const JITTER: i64 = 50_000_000;

/// The longest time from the creation of a publisher until this node discovers it \[ns\].
const FOUND: i64 = 300_000_000;

/// The estimate of how far a sender's clock differs from the clock of this host.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct SenderClock {
    fastest: Option<Arrival>,
    /// The arrival of a message that seems to be late.
    doubtful: Option<Arrival>,
}

/// The arrival of a message.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Arrival {
    /// The time of arrival by this host's clock, minus the time of sending by the sender's clock \[ns\].
    offset: i64,
    at: Duration,
}

impl SenderClock {
    /// Returns the age of a message that arrived at `now` with this [`offset`](Arrival::offset) \[ns\].
    ///
    /// `found` returns the time since this node discovered the publisher \[ns\], or `None` if the publisher may be older than this
    /// node. This time limits the age, because a message cannot be older than its publisher. A larger offset shows that the clocks
    /// do not agree.
    pub fn age(&mut self, offset: i64, now: Duration, found: impl FnOnce() -> Option<i64>) -> Duration {
        let none = self.fastest_by(now).unwrap_or(0);
        if offset <= none {
            (self.fastest, self.doubtful) = (Some(Arrival { offset, at: now }), None);
            return Duration::ZERO;
        }
        let came_as_sent = self.doubtful.is_some_and(|before| {
            now.saturating_sub(before.at) >= APART && (offset - before.offset).abs() <= JITTER
        });
        let impossible =
            offset >= KEPT || offset >= FOUND && found().is_some_and(|found| offset > found + FOUND);
        if came_as_sent || impossible {
            let fastest =
                self.doubtful.filter(|_| came_as_sent).map_or(offset, |before| before.offset.min(offset));
            (self.fastest, self.doubtful) = (Some(Arrival { offset: fastest, at: now }), None);
            return Duration::from_nanos((offset - fastest).unsigned_abs());
        }
        if self
            .doubtful
            .is_none_or(|before| offset < before.offset - JITTER || now.saturating_sub(before.at) >= APART)
        {
            self.doubtful = Some(Arrival { offset, at: now });
        }
        Duration::from_nanos((offset - none).unsigned_abs())
    }

    /// Returns the offset that a message without delay has at `now`; `None` if the sender's clock is not known yet.
    fn fastest_by(&self, now: Duration) -> Option<i64> {
        let Arrival { offset, at } = self.fastest?;
        let drift = DRIFT * now.saturating_sub(at).as_nanos() as f64;
        Some(offset.saturating_add(drift.min(MOST_DRIFT) as i64))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const S: i64 = 1_000_000_000;

    /// Returns the ages \[s\] of messages from a long-known publisher, given their times of arrival \[s\] and offsets \[s\].
    fn ages(messages: &[(f64, f64)]) -> Vec<f64> {
        let mut clock = SenderClock::default();
        let mut age = |(at, offset): &(f64, f64)| {
            clock.age((offset * 1e9) as i64, Duration::from_secs_f64(*at), || None).as_secs_f64()
        };
        messages.iter().map(|message| (1e6 * age(message)).round() / 1e6).collect()
    }

    #[test]
    fn with_synchronized_clocks_the_age_is_the_time_since_sending() {
        assert_eq!(ages(&[(10.0, 5.9)]), [5.9]);
        assert_eq!(ages(&[(10.0, 0.001), (11.0, 0.5)]), [0.001, 0.5]);
        // Messages that were sent while the cable was unplugged arrive at once, the oldest first.
        let burst = [(10.0, 5.0), (10.001, 4.0), (10.002, 3.0), (10.003, 0.2), (11.0, 0.0)];
        assert_eq!(ages(&burst), [5.0, 4.0, 3.0, 0.2, 0.0]);
    }

    #[test]
    fn a_clock_that_is_ahead_is_known_by_its_first_message() {
        assert_eq!(ages(&[(10.0, -60.0), (11.0, -55.0)]), [0.0, 5.0 - 0.0002]);
    }

    #[test]
    fn a_clock_that_is_behind_is_known_by_two_messages_that_come_as_they_are_sent() {
        assert_eq!(
            ages(&[(10.0, 60.0), (15.0, 60.01), (16.0, 60.0), (17.0, 62.0)]),
            [60.0, 0.01, 0.0, 1.9998]
        );
        assert_eq!(
            ages(&[(10.0, 0.15), (10.02, 0.15), (10.11, 0.15), (10.13, 0.15)]),
            [0.15, 0.15, 0.0, 0.0]
        );
        // The clock is set while the sender is running.
        assert_eq!(ages(&[(10.0, 0.0), (20.0, 3600.0), (21.0, 3600.0)])[1..], [0.0, 0.0]);
    }

    #[test]
    fn no_message_is_older_than_its_publisher() {
        let found = |offset, found| SenderClock::default().age(offset, Duration::from_secs(99), || found);
        assert_eq!(found(60 * S, Some(S / 10)), Duration::ZERO);
        assert_eq!(found(S + S / 20, Some(S / 2)), Duration::ZERO, "a clock that is a little behind");
        assert_eq!(found(60 * S, Some(90 * S)), Duration::from_secs(60));
        assert_eq!(found(60 * S, None), Duration::from_secs(60), "it was there before this node");
        assert_eq!(found(S / 4, Some(0)), Duration::from_millis(250));
        assert_eq!(found(i64::MAX, None), Duration::ZERO);
        assert_eq!(found(i64::MIN, None), Duration::ZERO);
    }

    #[test]
    fn a_publisher_is_late_even_after_a_long_silence() {
        let late = ages(&[(10.0, 0.0), (30_010.0, 5.9)])[1];
        assert!((late - 5.8).abs() < 1e-6, "{late}");
    }

    #[test]
    fn clocks_drift_apart_without_making_messages_late() {
        let mut clock = SenderClock::default();
        for minute in 0..600_u32 {
            let (now, offset) = (60 * minute, 6_000_000 * i64::from(minute));
            assert!(clock.age(offset, Duration::from_secs(now.into()), || None) < Duration::from_millis(1));
        }
    }
}
