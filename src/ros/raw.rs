//! Subscriptions that leave messages the bytes that they are.

use rustdds::QosPolicies;
use rustdds::QosPolicyBuilder;
use rustdds::policy::{Durability, History, Reliability, ResourceLimits};
use serde::de::{SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};
use std::fmt;

/// Samples that RustDDS keeps for a receiver that is behind; it says 64 unless told otherwise.
const UNTAKEN_SAMPLES: i32 = 10_000;

/// Encapsulation headers: plain CDR, big or little endian, no options.
const CDR_BE: [u8; 4] = [0, 0, 0, 0];
const CDR_LE: [u8; 4] = [0, 1, 0, 0];

/// A message as it came.
#[derive(Clone, Debug)]
pub struct RawMessage {
    /// The CDR payload after its encapsulation header of four bytes.
    pub cdr: Vec<u8>,
    /// When it was received \[ns\] since the Unix epoch.
    pub received: i64,
    /// When it was sent by the sender's clock, or else when it was received \[ns\].
    pub sent: i64,
}

/// Receives messages of any type undecoded.
pub struct RawSubscription {
    inner: ros2_client::Subscription<Payload>,
}

impl RawSubscription {
    pub(super) fn new(inner: ros2_client::Subscription<Payload>) -> Self {
        Self { inner }
    }

    /// Waits for the next message; one in an encoding other than plain CDR is passed over.
    pub async fn next(&self) -> RawMessage {
        loop {
            if let Ok((payload, info)) = self.inner.async_take().await {
                let now = super::messages::Time::now().nanoseconds();
                let received = info.received_timestamp().map_or(now, |time| time.to_nanos());
                let sent = info.source_timestamp().map_or(received, |time| time.to_nanos());
                return RawMessage { cdr: payload.0, received, sent };
            }
        }
    }
}

/// The QoS of a raw subscription.
pub(super) fn qos(reliable: bool, transient_local: bool) -> QosPolicies {
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
            max_samples: UNTAKEN_SAMPLES,
            max_instances: 1,
            max_samples_per_instance: UNTAKEN_SAMPLES,
        })
        .build()
}

/// A whole CDR payload with its encapsulation header.
pub(super) struct Payload(Vec<u8>);

impl<'de> Deserialize<'de> for Payload {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Bytes(Vec<u8>);
        impl<'de> Visitor<'de> for Bytes {
            type Value = Payload;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("bytes")
            }
            fn visit_seq<A: SeqAccess<'de>>(mut self, mut input: A) -> Result<Payload, A::Error> {
                // The payload ends where the input does, which CDR reports as an error.
                while let Ok(Some(byte)) = input.next_element() {
                    self.0.push(byte);
                }
                Ok(Payload(self.0))
            }
        }
        // RustDDS takes the encapsulation header off and tells of it only by the type of its deserializer.
        let big_endian = std::any::type_name::<D>().contains("BigEndian");
        let header = if big_endian { CDR_BE } else { CDR_LE };
        deserializer.deserialize_tuple(usize::MAX, Bytes(header.to_vec()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rustdds::RepresentationIdentifier;
    use rustdds::serialization::deserialize_from_cdr_with_rep_id;

    #[test]
    fn a_payload_keeps_every_byte_and_its_byte_order() {
        let body: Vec<u8> = (0..=255).collect();
        for (encoding, header) in
            [(RepresentationIdentifier::CDR_LE, CDR_LE), (RepresentationIdentifier::CDR_BE, CDR_BE)]
        {
            let (payload, _) = deserialize_from_cdr_with_rep_id::<Payload>(&body, encoding).unwrap();
            assert_eq!(payload.0, [&header[..], &body].concat());
        }
    }
}
