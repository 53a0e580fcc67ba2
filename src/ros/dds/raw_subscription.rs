//! Subscriptions that return messages undecoded.
//!
//! RustDDS 0.15.1 strips the header that names the encoding, and passes the encoding only to a decoder. The `Subscription` of
//! ros2-client does not let us choose the decoder. So these subscriptions read from RustDDS directly. Delete this module when
//! either library returns undecoded samples.

use super::kept_samples::{FEWEST_SAMPLES, Kept, Room};
use dq_messages::messages::Time;
use futures::StreamExt;
use ros2_client::ROSTime;
use rustdds::dds::CreateResult;
use rustdds::no_key::{Decode, DefaultDecoder, DeserializerAdapter, SimpleDataReader};
use rustdds::policy::{Durability, History, Reliability, ResourceLimits};
use rustdds::{
    DomainParticipant, GUID, QosPolicies, QosPolicyBuilder, RepresentationIdentifier, Timestamp, Topic,
};
use std::convert::Infallible;
use std::future::pending;
use std::pin::pin;

/// An undecoded message.
#[derive(Clone, Debug)]
pub struct RawMessage {
    /// The CDR payload after its encapsulation header of four bytes.
    pub cdr: Vec<u8>,
    /// The time at which the message was received \[ns since 1970\].
    pub received: i64,
    /// The time at which the message was sent, by the sender's clock \[ns since 1970\]. If that time is unknown, this is equal to
    /// `received`.
    pub sent: i64,
    /// The GUID of the publisher.
    pub publisher: [u8; 16],
    /// The sequence number that the publisher gave the message. There is a gap only if messages were lost.
    pub sequence: i64,
}

/// Receives messages of any type undecoded.
pub struct RawSubscription {
    inner: SimpleDataReader<Undecoded, Undecoded>,
    kept: Kept,
    /// Sets how many samples RustDDS stores.
    keep: Box<dyn Fn(i32) + Send + Sync>,
}

impl RawSubscription {
    pub(crate) fn new(
        participant: &DomainParticipant,
        topic: &Topic,
        keep: impl Fn(i32) + Send + Sync + 'static,
    ) -> CreateResult<Self> {
        let subscriber = participant.create_subscriber(&QosPolicies::qos_none())?;
        let inner = subscriber.create_simple_datareader_no_key(topic, None)?;
        Ok(Self { inner, kept: Kept::default(), keep: Box::new(keep) })
    }

    /// Returns the GUID of the reader.
    pub(crate) fn guid(&self) -> GUID {
        self.inner.guid()
    }

    /// Waits for the next message. Messages in an encoding other than plain CDR are skipped. Returns `None` once the messages have
    /// become so large that they exceed the memory budget: drop the subscription then.
    pub async fn next(&mut self) -> Option<RawMessage> {
        let sample = {
            let mut samples = pin!(self.inner.as_async_stream());
            loop {
                match samples.next().await {
                    Some(Ok(sample)) => break sample,
                    Some(Err(_)) => {}
                    // The stream does not end; if it did, there would be no more messages.
                    None => pending().await,
                }
            }
        };
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

/// Converts a DDS time to nanoseconds since 1970, as ros2-client does. Returns `None` for a time that cannot be converted.
fn nanoseconds(time: Timestamp) -> Option<i64> {
    ROSTime::try_from(time).ok().map(|time| time.to_nanos())
}

/// A message in plain CDR with its encapsulation header of four bytes. The type is also its own deserializer adapter.
#[derive(Clone)]
pub(crate) struct Undecoded(pub(crate) Vec<u8>);

impl DeserializerAdapter<Self> for Undecoded {
    type Error = Infallible;
    type Decoded = Self;

    fn supported_encodings() -> &'static [RepresentationIdentifier] {
        &[RepresentationIdentifier::CDR_LE, RepresentationIdentifier::CDR_BE]
    }

    fn transform_decoded(decoded: Self) -> Self {
        decoded
    }
}

impl DefaultDecoder<Self> for Undecoded {
    type Decoder = AsItIs;
    const DECODER: AsItIs = AsItIs;
}

/// A decoder that returns the bytes unchanged.
#[derive(Clone)]
pub(crate) struct AsItIs;

impl Decode<'_, Undecoded> for AsItIs {
    type Error = Infallible;

    fn decode_bytes(self, bytes: &[u8], encoding: RepresentationIdentifier) -> Result<Undecoded, Infallible> {
        let [high, low] = encoding.to_bytes();
        Ok(Undecoded([&[high, low, 0, 0], bytes].concat()))
    }
}

/// Returns the QoS of a raw subscription for which RustDDS stores this many samples.
pub(crate) fn qos(reliable: bool, transient_local: bool, samples: Option<i32>) -> QosPolicies {
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
    fn a_payload_keeps_every_byte_and_its_byte_order() {
        let body: Vec<u8> = (0..=255).collect();
        let encodings = [RepresentationIdentifier::CDR_BE, RepresentationIdentifier::CDR_LE];
        for (low, encoding) in (0..).zip(encodings) {
            let Ok(Undecoded(bytes)) = AsItIs.decode_bytes(&body, encoding);
            assert_eq!(bytes, [&[0, low, 0, 0], &body[..]].concat());
        }
    }
}
