//! Who sent a message, and when.

use super::graph::EndpointId;
use super::reader::Sample;
use crate::dds::matches::Matches;
use rustdds::{GUID, Timestamp};
use serde::de::DeserializeOwned;
use std::time::Duration;

/// Who sent a message, and when.
#[derive(Clone, Copy)]
pub struct Origin<'a> {
    /// Its publisher.
    pub publisher: EndpointId,
    /// When it was sent by the sender's clock \[ns since 1970\], where that is known.
    pub sent: Option<i64>,
    writer: GUID,
    matches: &'a Matches,
}

impl<'a> Origin<'a> {
    pub(super) fn of<M: DeserializeOwned + 'static>(sample: &Sample<M>, matches: &'a Matches) -> Self {
        Self {
            publisher: sample.writer_guid.into(),
            sent: sample.source_timestamp().and_then(nanoseconds),
            writer: sample.writer_guid,
            matches,
        }
    }

    /// For how long the publisher has been known; none where it may have been there before this process.
    pub fn known_for(&self) -> Option<Duration> {
        self.matches.known_for(self.writer)
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
}
