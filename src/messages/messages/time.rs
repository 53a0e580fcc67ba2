//! Times, and the header of many messages.

use super::{Message, message};
use serde::{Deserialize, Serialize};
use std::time::Duration;

message! {
    /// A point in time: seconds and nanoseconds since the Unix epoch.
    Time = "builtin_interfaces/msg/Time" {
        sec: i32,
        nanosec: u32,
    }
}

impl Time {
    /// Returns the time of the wall clock. A time before 1970 or after 2038 saturates.
    pub fn now() -> Self {
        let since_epoch =
            std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap_or_default();
        Self {
            sec: i32::try_from(since_epoch.as_secs()).unwrap_or(i32::MAX),
            nanosec: since_epoch.subsec_nanos(),
        }
    }

    /// Returns the nanoseconds since the Unix epoch.
    pub fn nanoseconds(&self) -> i64 {
        i64::from(self.sec) * 1_000_000_000 + i64::from(self.nanosec)
    }

    /// Returns the time that is `age` earlier. A time before 1970 saturates.
    pub fn before(&self, age: std::time::Duration) -> Self {
        let age = i64::try_from(age.as_nanos()).unwrap_or(i64::MAX);
        Self::from_nanoseconds(self.nanoseconds().saturating_sub(age))
    }

    /// Creates a time from nanoseconds since the Unix epoch. A time before 1970 or after 2038 saturates.
    pub fn from_nanoseconds(nanoseconds: i64) -> Self {
        let nanoseconds = nanoseconds.max(0).unsigned_abs();
        let (sec, nanosec) = (nanoseconds / 1_000_000_000, nanoseconds % 1_000_000_000);
        Self {
            sec: i32::try_from(sec).unwrap_or(i32::MAX),
            nanosec: u32::try_from(nanosec).unwrap_or_default(),
        }
    }

    /// Returns the time that is one nanosecond later.
    pub fn plus_a_nanosecond(&self) -> Self {
        match self.nanosec {
            ..999_999_999 => Self { nanosec: self.nanosec + 1, ..*self },
            _ => Self { sec: self.sec.saturating_add(1), nanosec: 0 },
        }
    }

    /// Returns whether the time is zero, which means that it is not set.
    pub fn is_zero(&self) -> bool {
        *self == Self::default()
    }
}

/// Formats a time in seconds, with nine digits after the decimal point.
impl std::fmt::Display for Time {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}.{:09}", self.sec, self.nanosec)
    }
}

message! {
    /// A time and a frame.
    Header = "std_msgs/msg/Header" {
        stamp: Time,
        #[serde(deserialize_with = "dq_common::text::deserialize_cut")]
        frame_id: String,
    }
}
impl Header {
    /// Creates a header with the time of the wall clock.
    pub fn now(frame_id: &str) -> Self {
        Self { stamp: Time::now(), frame_id: frame_id.to_owned() }
    }
}

message! {
    /// The present time of a simulated clock.
    ClockMessage = "rosgraph_msgs/msg/Clock" {
        clock: Time,
    }

    /// A duration.
    DurationMessage = "builtin_interfaces/msg/Duration" {
        sec: i32,
        nanosec: u32,
    }
}

impl From<Duration> for DurationMessage {
    fn from(time: Duration) -> Self {
        Self { sec: i32::try_from(time.as_secs()).unwrap_or(i32::MAX), nanosec: time.subsec_nanos() }
    }
}

/// Converts a duration; a negative one becomes zero.
impl From<&DurationMessage> for Duration {
    fn from(time: &DurationMessage) -> Self {
        u64::try_from(time.sec)
            .map_or(Self::ZERO, |seconds| Self::from_secs(seconds) + Self::from_nanos(time.nanosec.into()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn now_is_after_this_code_was_written() {
        assert!(Time::now().sec > 1_790_000_000);
    }

    #[test]
    fn a_time_before_another_is_that_much_earlier() {
        let time = Time { sec: 7, nanosec: 3 };
        let before = |ms| time.before(std::time::Duration::from_millis(ms));
        assert_eq!(before(0), time);
        assert_eq!(before(2500), Time { sec: 4, nanosec: 500_000_003 });
        assert_eq!(before(9000), Time::default());
    }

    #[test]
    fn the_next_instant_is_a_nanosecond_later() {
        for (sec, nanosec) in [(0, 0), (7, 999_999_998), (7, 999_999_999)] {
            let time = Time { sec, nanosec };
            assert_eq!(time.plus_a_nanosecond().nanoseconds(), time.nanoseconds() + 1);
        }
    }
}
