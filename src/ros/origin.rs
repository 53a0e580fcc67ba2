//! Who sent a message, and when.

use super::graph::EndpointId;
use super::reader::Sample;
use crate::wire::messages::Time;
use rustdds::Timestamp;
use serde::de::DeserializeOwned;
use std::time::Duration;

/// Who sent a message, and when.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Origin {
    /// Its publisher.
    pub publisher: EndpointId,
    /// When it was sent by the sender's clock \[ns since 1970\], where that is known.
    sent: Option<i64>,
}

/// Nobody keeps messages longer than that for a reader that is gone: it is some times the lease after which it is lost, which is 50 s for
/// nodes of this program, and 10 and 20 s for those of Cyclone and Fast DDS. By clocks that are farther apart nothing can be said.
const KEPT: Duration = Duration::from_secs(300);

impl Origin {
    pub(super) fn of<M: DeserializeOwned + 'static>(sample: &Sample<M>) -> Self {
        Self {
            publisher: EndpointId::new(sample.writer_guid.to_bytes()),
            sent: sample.source_timestamp().and_then(nanoseconds),
        }
    }

    /// How long before `began` the message was sent, by its sender's clock, if it is left over from then.
    ///
    /// By DDS who subscribes VOLATILE gets only what is sent from then on. But RustDDS 0.15.1 asks each publisher for all that it
    /// keeps, and gets it: what a subscriber that was killed has not acknowledged is kept until its lease ends. A goal from before would
    /// move the arm when a servo is started again.
    pub fn left_over(&self, began: &Time) -> Option<Duration> {
        let age = u64::try_from(began.nanoseconds().checked_sub(self.sent?)?).ok()?;
        Some(Duration::from_nanos(age)).filter(|age| !age.is_zero() && *age < KEPT)
    }
}

/// Nanoseconds since the Unix epoch, which is where the time of DDS begins; none where there is no time.
pub(super) fn nanoseconds(time: Timestamp) -> Option<i64> {
    let known = time != Timestamp::INVALID && time != Timestamp::INFINITE;
    // Seconds, and their fraction in units of 2⁻³² s.
    let (seconds, fraction) = (time.to_ticks() >> 32, time.to_ticks() & u64::from(u32::MAX));
    let nanoseconds = seconds * 1_000_000_000 + ((fraction * 1_000_000_000 + (1 << 31)) >> 32);
    i64::try_from(nanoseconds).ok().filter(|_| known)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_of_dds_are_nanoseconds_since_1970() {
        assert_eq!(nanoseconds(Timestamp::ZERO), Some(0));
        assert_eq!(
            nanoseconds(Timestamp::from_ticks((1_700_000_000 << 32) + (1 << 31))),
            Some(1_700_000_000_500_000_000)
        );
        assert_eq!(nanoseconds(Timestamp::from_ticks(u64::from(u32::MAX))), Some(1_000_000_000), "rounded");
        assert_eq!([Timestamp::INVALID, Timestamp::INFINITE].map(nanoseconds), [None, None]);
    }

    #[test]
    fn what_was_sent_some_time_before_is_left_over() {
        const BEGAN: i64 = 1_700_000_000_000_000_000;
        let age = |sent| {
            let origin = Origin { publisher: EndpointId::new([1; 16]), sent };
            origin.left_over(&Time::from_nanoseconds(BEGAN))
        };
        assert_eq!(age(Some(BEGAN - 1)), Some(Duration::from_nanos(1)));
        assert_eq!(age(Some(BEGAN - 299_000_000_000)), Some(Duration::from_secs(299)));
        // Sent since; by a clock that was never set; by one far ahead; at no known time.
        for sent in [Some(BEGAN), Some(BEGAN + 1), Some(0), Some(i64::MAX), Some(i64::MIN), None] {
            assert_eq!(age(sent), None, "{sent:?}");
        }
    }
}
