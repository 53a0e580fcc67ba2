//! Service servers that answer every vendor's clients.
//!
//! Fast DDS and RustDDS clients put the request's identity into the sample's inline QoS ("enhanced" mapping). Cyclone's
//! put a header of 16 bytes before the payload and expect it back. A server here distinguishes them request by request:
//! payloads are received raw, and a sample from a Cyclone writer is read with the header first.

use super::log::Logger;
use super::matches::Matches;
use super::padded::Padded;
use super::raw_cdr::RawCdr;
use crate::text::cut;
use crate::wire::messages::ServiceType;
use crate::wire::{CDR_LE, decode_payload};
use futures::StreamExt;
use ros2_client::{QosProfile, RmwRequestId, Server};
use rustdds::serialization::to_writer_with_rep_id;
use rustdds::{DomainParticipant, RepresentationIdentifier};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::time::Duration;

/// RTPS vendor id of Eclipse Cyclone DDS: the first two bytes of its GUIDs.
pub(super) const CYCLONE_VENDOR: [u8; 2] = [0x01, 0x10];

/// Length of Cyclone's request header: client GUID half and sequence number.
const CYCLONE_HEADER: usize = 16;

/// A longer reply [bytes] goes out in fragments, at which Cyclone's clients hang, and with them all that they do later.
const LONGEST_REPLY: usize = 64_000;

/// ROS 2's QoS for services: reliable, volatile, keep last 10.
pub(super) fn qos() -> QosProfile {
    QosProfile::publisher_default().history(ros2_client::qos::History::KeepLast { depth: 10 })
}

/// Knows when a reply can reach who asked.
///
/// RustDDS measures its datagrams by the readers that are matched. A reply that is written before its reader is matched may be
/// cut into fragments of a whole sample that would have fit, and RustDDS 0.15.1 puts a byte too much before the inline QoS of a
/// fragment, so that no vendor can read it (its debug build panics).
pub(super) struct ReplyReaders {
    participant: DomainParticipant,
    matches: Matches,
    topic: String,
}

/// How long a client's reader may take to be matched.
const TO_BE_MATCHED: Duration = Duration::from_millis(500);

/// A reply of this length [bytes] fits into one datagram anywhere.
const ONE_DATAGRAM: usize = 1200;

impl ReplyReaders {
    /// Of the service with that fully qualified name.
    pub fn new(participant: DomainParticipant, matches: Matches, service: &str) -> Self {
        Self { participant, matches, topic: format!("rr{service}Reply") }
    }

    /// Waits until the reader of who sent the request `id` is matched; whether it is.
    async fn matched(&self, id: &RmwRequestId) -> bool {
        let client = id.writer_gid.to_bytes16();
        let is_matched = |matches: &Matches| {
            let readers = self.participant.discovered_readers();
            let mut guids = readers
                .iter()
                .filter(|reader| *reader.subscription_topic_data.topic_name() == self.topic)
                .map(|reader| reader.reader_proxy.remote_reader_guid);
            guids.any(|guid| guid.to_bytes()[..12] == client[..12] && matches.has_remote(guid))
        };
        tokio::time::timeout(TO_BE_MATCHED, self.matches.wait_until(is_matched)).await.is_ok()
    }
}

/// Answers requests by `handler` for ever.
pub(super) async fn serve<S: ServiceType, F: Future<Output = S::Response>>(
    server: Server<RawCdr, RawCdr>,
    name: String,
    readers: ReplyReaders,
    mut handler: impl FnMut(S::Request) -> F,
    log: Logger,
) {
    let mut requests = server.receive_request_stream();
    while let Some(request) = requests.next().await {
        let Ok((id, payload)) = request else { continue };
        let Some((header, request)) = decode::<S::Request>(&id, &payload) else {
            log.warn(&format!("{name}: a request that is no {} was passed over", S::TYPE));
            continue;
        };
        let reply = encode(&header, &handler(request).await);
        let sent = match reply {
            Some(reply) if reply.0.len() > LONGEST_REPLY => Err(format!("it has {} bytes", reply.0.len())),
            Some(reply) if !readers.matched(&id).await && reply.0.len() > ONE_DATAGRAM => {
                Err("who asked does not listen".to_owned())
            }
            Some(reply) => server.async_send_response(id, reply).await.map_err(|why| why.to_string()),
            None => Err("it cannot be encoded".to_owned()),
        };
        if let Err(why) = sent {
            log.error(&format!("{name}: a reply could not be sent: {}", cut(&why)));
        }
    }
}

/// The header of a Cyclone client, if there is one, and the request.
fn decode<T: DeserializeOwned>(id: &RmwRequestId, raw: &RawCdr) -> Option<(Vec<u8>, T)> {
    let (encoding, payload) = raw.parts()?;
    let from_cyclone = id.writer_gid.to_bytes16()[..2] == CYCLONE_VENDOR;
    let with_header = from_cyclone
        .then(|| payload.split_at_checked(CYCLONE_HEADER))
        .flatten()
        .and_then(|(header, body)| Some((header.to_vec(), decode_all(encoding, body)?)));
    with_header.or_else(|| Some((Vec::new(), decode_all(encoding, payload)?)))
}

/// Decodes a value that takes the whole payload, but for padding to four bytes.
fn decode_all<T: DeserializeOwned>(encoding: [u8; 4], payload: &[u8]) -> Option<T> {
    let (value, consumed) = decode_payload::<T>(encoding, payload).ok()?;
    (payload.len().saturating_sub(consumed) < 4).then_some(value)
}

fn encode<T: Serialize>(header: &[u8], value: &T) -> Option<RawCdr> {
    let mut body = Vec::new();
    to_writer_with_rep_id(&mut body, &Padded(value), RepresentationIdentifier::CDR_LE).ok()?;
    Some(RawCdr([&CDR_LE, header, &body].concat()))
}
