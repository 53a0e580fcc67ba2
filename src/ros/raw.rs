//! Subscriptions that leave messages the bytes that they are.

use super::origin::nanoseconds;
use super::raw_cdr::RawCdr;
use super::reader::Reader;
use crate::wire::messages::Time;
use rustdds::QosPolicies;
use rustdds::QosPolicyBuilder;
use rustdds::policy::{Durability, History, Reliability, ResourceLimits};
use std::collections::VecDeque;

/// RustDDS keeps so many samples of a topic, whether they have been taken or not. It can be made to keep more, but never fewer again:
/// so there are few before the size of the messages is known, and as many as have room then.
const FEWEST_SAMPLES: i32 = 128;
const MOST_SAMPLES: i32 = 10_000;

/// The room for the samples of a topic \[bytes\], where messages stay as large as the first ones.
const ROOM: usize = 32 << 20;

/// What the last samples may have at most \[bytes\], where later messages are larger.
const LIMIT: usize = 256 << 20;

/// What RustDDS takes for a sample besides its payload \[bytes\], as measured.
const OVERHEAD: usize = 500;

/// A message as it came.
#[derive(Clone, Debug)]
pub struct RawMessage {
    /// The CDR payload after its encapsulation header of four bytes.
    pub cdr: Vec<u8>,
    /// When it was received \[ns\] since the Unix epoch.
    pub received: i64,
    /// When it was sent by the sender's clock, or else when it was received \[ns\].
    pub sent: i64,
    /// Who sent it.
    pub publisher: [u8; 16],
    /// Which one of its publisher's messages it is, without a gap where none was lost.
    pub sequence: i64,
}

/// Receives messages of any type undecoded.
pub struct RawSubscription {
    inner: Reader<RawCdr>,
    kept: Kept,
    /// Makes RustDDS keep so many samples.
    keep: Box<dyn Fn(i32) + Send + Sync>,
}

impl RawSubscription {
    pub(super) fn new(inner: Reader<RawCdr>, keep: impl Fn(i32) + Send + Sync + 'static) -> Self {
        Self { inner, kept: Kept::default(), keep: Box::new(keep) }
    }

    /// Waits for the next message; one in an encoding other than plain CDR is passed over. None once the messages have grown so large
    /// that there is no room for them: the subscription should be dropped then.
    pub async fn next(&mut self) -> Option<RawMessage> {
        let sample = self.inner.next().await;
        match self.kept.take(sample.sample.0.len()) {
            Room::Enough => {}
            Room::More(samples) => (self.keep)(samples),
            Room::None => return None,
        }
        let received = nanoseconds(sample.receive_instant).unwrap_or_else(|| Time::now().nanoseconds());
        let sent = sample.source_timestamp().and_then(nanoseconds).unwrap_or(received);
        let (publisher, sequence) = (sample.writer_guid.to_bytes(), i64::from(sample.sequence_number));
        Some(RawMessage { cdr: sample.into_value().0, received, sent, publisher, sequence })
    }
}

/// What RustDDS keeps of a topic.
struct Kept {
    samples: i32,
    largest: usize,
    /// Of the last samples, as many as are kept \[bytes\], and their sum.
    sizes: VecDeque<usize>,
    sum: usize,
}

impl Default for Kept {
    fn default() -> Self {
        Self { samples: FEWEST_SAMPLES, largest: 0, sizes: VecDeque::new(), sum: 0 }
    }
}

/// Whether there is room for the samples of a topic.
#[derive(Debug, PartialEq)]
enum Room {
    Enough,
    /// For that many.
    More(i32),
    None,
}

impl Kept {
    /// One more sample of so many bytes.
    fn take(&mut self, bytes: usize) -> Room {
        let size = bytes + OVERHEAD;
        self.sizes.push_back(size);
        self.sum += size;
        while self.sizes.len() > usize::try_from(self.samples).unwrap_or(0) {
            self.sum -= self.sizes.pop_front().unwrap_or(0);
        }
        if self.sum > LIMIT {
            return Room::None;
        }
        self.largest = self.largest.max(size);
        let fit = i32::try_from(ROOM / self.largest).unwrap_or(MOST_SAMPLES).min(MOST_SAMPLES);
        if fit <= self.samples {
            return Room::Enough;
        }
        self.samples = fit;
        Room::More(fit)
    }
}

/// The QoS of a raw subscription, of which so many samples are kept.
pub(super) fn qos(reliable: bool, transient_local: bool, samples: Option<i32>) -> QosPolicies {
    let samples = samples.unwrap_or(FEWEST_SAMPLES);
    let reliability = match reliable {
        true => Reliability::Reliable { max_blocking_time: rustdds::Duration::ZERO },
        false => Reliability::BestEffort,
    };
    let durability = if transient_local { Durability::TransientLocal } else { Durability::Volatile };
    QosPolicyBuilder::new()
        .reliability(reliability)
        .durability(durability)
        .history(History::KeepLast { depth: 10 })
        .resource_limits(ResourceLimits {
            max_samples: samples,
            max_instances: 1,
            max_samples_per_instance: samples,
        })
        .build()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn as_many_samples_are_kept_as_have_room() {
        let mut small = Kept::default();
        assert_eq!(small.take(200), Room::More(MOST_SAMPLES));
        assert!((0..100_000).all(|_| small.take(200) == Room::Enough));
        let mut large = Kept::default();
        assert!(
            (0..100_000).all(|_| large.take(1 << 20) == Room::Enough),
            "FEWEST_SAMPLES of 1 MB are 128 MB"
        );
        let until_full = (0..).take_while(|_| small.take(1 << 20) == Room::Enough).count();
        assert!((200..=256).contains(&until_full), "{until_full}");
    }
}
