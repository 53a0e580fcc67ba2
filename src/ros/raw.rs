//! Subscriptions that leave messages the bytes that they are.

use super::origin::nanoseconds;
use super::reader::Reader;
use crate::dds::kept_samples::{FEWEST_SAMPLES, Kept, Room};
use crate::dds::raw_cdr::RawCdr;
use crate::wire::messages::Time;
use rustdds::QosPolicies;
use rustdds::QosPolicyBuilder;
use rustdds::policy::{Durability, History, Reliability, ResourceLimits};

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
