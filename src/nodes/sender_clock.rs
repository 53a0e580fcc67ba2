//! How long a message was under way, by a sender's clock that may be wrong.
//!
//! Between two clocks nobody can tell a late message from a clock that is behind. So clocks are taken to agree until the sender's own
//! messages show that they do not: then the age of a message is what it is later than the sender's fastest ones. A wrong clock costs the
//! age its sharpness, and a publisher that is known for long at most the messages of the first moment, which are rejected with their age.

use std::time::Duration;

/// Nobody keeps messages for a reader that is gone for longer than this: some times the lease after which it is lost, 50 s for nodes of
/// this program, and 10 and 20 s for those of Cyclone and Fast DDS. Clocks that are farther apart do not agree.
const KEPT: i64 = 300_000_000_000;

/// Clocks go wrong by less than this part: an age of no more than this since the fastest message is none, and of no more than the most in
/// any case \[ns\], since clocks that somebody sets right do not go on drifting apart.
const DRIFT: f64 = 2e-4;
const MOST_DRIFT: f64 = 1e8;

/// Two messages that come so long after each other, and were sent as long after each other but for the jitter \[ns\], come as they are
/// sent. What was held up comes at once.
const APART: Duration = Duration::from_millis(100);
const JITTER: i64 = 50_000_000;

/// A publisher is found so soon after it was made \[ns\].
const FOUND: i64 = 300_000_000;

/// What is known of a sender's clock.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct SenderClock {
    fastest: Option<Came>,
    /// One that seems to be late.
    doubtful: Option<Came>,
}

/// A message as it came.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Came {
    /// How much later than sent it came, by both clocks \[ns\].
    offset: i64,
    at: Duration,
}

impl SenderClock {
    /// How long a message was under way that came at `now` with this `offset` \[ns\]. `found` is for how long its publisher has been known
    /// \[ns\], if that was found while this node was there: none of its messages is older.
    pub fn age(&mut self, offset: i64, now: Duration, found: impl FnOnce() -> Option<i64>) -> Duration {
        let none = self.fastest_by(now).unwrap_or(0);
        if offset <= none {
            (self.fastest, self.doubtful) = (Some(Came { offset, at: now }), None);
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
            (self.fastest, self.doubtful) = (Some(Came { offset: fastest, at: now }), None);
            return Duration::from_nanos((offset - fastest).unsigned_abs());
        }
        if self
            .doubtful
            .is_none_or(|before| offset < before.offset - JITTER || now.saturating_sub(before.at) >= APART)
        {
            self.doubtful = Some(Came { offset, at: now });
        }
        Duration::from_nanos((offset - none).unsigned_abs())
    }

    /// The offset of a message that is under way for no time, as far as that is known at `now`.
    fn fastest_by(&self, now: Duration) -> Option<i64> {
        let Came { offset, at } = self.fastest?;
        let drift = DRIFT * now.saturating_sub(at).as_nanos() as f64;
        Some(offset.saturating_add(drift.min(MOST_DRIFT) as i64))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const S: i64 = 1_000_000_000;

    /// The ages [s] of messages by the times [s] at which they came and their offsets [s], of a publisher that is known for long.
    fn ages(messages: &[(f64, f64)]) -> Vec<f64> {
        let mut clock = SenderClock::default();
        let mut age = |(at, offset): &(f64, f64)| {
            clock.age((offset * 1e9) as i64, Duration::from_secs_f64(*at), || None).as_secs_f64()
        };
        messages.iter().map(|message| (1e6 * age(message)).round() / 1e6).collect()
    }

    #[test]
    fn where_clocks_agree_the_age_is_the_time_under_way() {
        assert_eq!(ages(&[(10.0, 5.9)]), [5.9]);
        assert_eq!(ages(&[(10.0, 0.001), (11.0, 0.5)]), [0.001, 0.5]);
        // What was sent while the cable was out comes at once, the oldest first.
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
        // And one that is set.
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
    fn a_publisher_that_was_silent_for_long_is_late_all_the_same() {
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
