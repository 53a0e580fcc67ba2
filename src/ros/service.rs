//! Service servers that answer every vendor's clients.
//!
//! Fast DDS and RustDDS clients put the request's identity into the sample's inline QoS ("enhanced" mapping). Cyclone's
//! put a header of 16 bytes before the payload and expect it back. A server here distinguishes them request by request:
//! payloads are received raw, and a sample from a Cyclone writer is read with the header first.

use super::log::Logger;
use super::origin::Origin;
use super::reader::{Reader, Sample};
use super::writer::Writer;
use crate::dds::large_replies::ReplyRoom;
use crate::dds::matches::Matches;
use crate::dds::payload_padding::Padded;
use crate::dds::raw_cdr::RawCdr;
use crate::dds::vendor::is_cyclone;
use crate::text::cut;
use crate::wire::messages::ServiceType;
use crate::wire::{CDR_LE, decode_payload};
use futures::StreamExt;
use futures::stream::FuturesUnordered;
use rustdds::policy::{History, Reliability};
use rustdds::serialization::to_writer_with_rep_id;
use rustdds::{
    GUID, QosPolicies, QosPolicyBuilder, RepresentationIdentifier, SampleIdentity, SequenceNumber,
};
use rustdds::{Timestamp, WriteOptions, WriteOptionsBuilder};
use serde::Serialize;
use serde::de::DeserializeOwned;

/// Length of Cyclone's request header: client GUID half and sequence number.
pub(super) const CYCLONE_HEADER: usize = 16;

/// ROS 2's QoS for services: reliable, volatile, keep last 10. Who writes waits for room a moment.
pub(super) fn qos() -> QosPolicies {
    QosPolicyBuilder::new()
        .reliability(Reliability::Reliable { max_blocking_time: rustdds::Duration::from_millis(100) })
        .history(History::KeepLast { depth: 10 })
        .build()
}

/// Who asked, and how the answer finds the question.
struct Asked {
    client: GUID,
    /// Of Cyclone's clients the header that goes back before the payload.
    header: Vec<u8>,
    /// Of the others what the answer's inline QoS names.
    identity: SampleIdentity,
}

impl Asked {
    fn options(&self) -> WriteOptions {
        let options = WriteOptionsBuilder::new().source_timestamp(Timestamp::now());
        match self.header.is_empty() {
            true => options.related_sample_identity(self.identity).build(),
            false => options.build(),
        }
    }
}

/// Requests that are answered at once; more wait.
const AT_ONCE: usize = 100;

/// Answers requests by `handler` for ever. It is called in the order of the requests, and none of the answers waits for another: who is
/// gone keeps its own waiting.
pub(super) async fn serve<S: ServiceType, F: Future<Output = S::Response>>(
    requests: Reader<RawCdr>,
    replies: Writer<RawCdr>,
    name: String,
    (room, matches): (ReplyRoom, Matches),
    mut handler: impl FnMut(S::Request, &Origin) -> F,
    log: Logger,
) {
    let answer = async |asked: Asked, response: F| {
        let response = response.await;
        let room = room.of(asked.client).await;
        let sent = match fitting::<S>(&asked.header, response, room) {
            Ok(reply) => replies.write_with(reply, asked.options()).await.map(drop),
            Err(why) => Err(why),
        };
        if let Err(why) = sent {
            log.error(&format!("{name}: a reply could not be sent: {}", cut(&why)));
        }
    };
    let mut answers = FuturesUnordered::new();
    loop {
        let sample = tokio::select! {
            sample = requests.next(), if answers.len() < AT_ONCE => sample,
            Some(()) = answers.next() => continue,
        };
        match decode::<S::Request>(&sample) {
            Some((asked, request)) => {
                let response = handler(request, &Origin::of(&sample, &matches));
                answers.push(answer(asked, response));
            }
            None => log.warn(&format!("{name}: a request that is no {} was passed over", S::TYPE)),
        }
    }
}

/// The reply, or what the service says in place of one that is too long.
fn fitting<S: ServiceType>(header: &[u8], response: S::Response, room: usize) -> Result<RawCdr, String> {
    let unencodable = || "it cannot be encoded".to_owned();
    let reply = encode(header, &response).ok_or_else(unencodable)?;
    let bytes = reply.0.len();
    if bytes <= room {
        return Ok(reply);
    }
    let excuse = S::too_long(bytes, room)
        .ok_or_else(|| format!("it has {bytes} bytes, and {room} can reach the client"))?;
    encode(header, &excuse).ok_or_else(unencodable)
}

/// Who asked, and what.
fn decode<T: DeserializeOwned>(sample: &Sample<RawCdr>) -> Option<(Asked, T)> {
    let (encoding, payload) = sample.sample.parts()?;
    let with_header = is_cyclone(sample.writer_guid)
        .then(|| payload.split_at_checked(CYCLONE_HEADER))
        .flatten()
        .and_then(|(header, body)| Some((header.to_vec(), decode_all(encoding, body)?)));
    let (header, request) = with_header.or_else(|| Some((Vec::new(), decode_all(encoding, payload)?)))?;
    let own = SampleIdentity { writer_guid: sample.writer_guid, sequence_number: sample.sequence_number };
    // Fast DDS leaves the number for the sample's own.
    let named = sample.related_sample_identity().map(|named| match named.sequence_number {
        SequenceNumber::UNKNOWN => SampleIdentity { sequence_number: sample.sequence_number, ..named },
        _ => named,
    });
    let identity = named.unwrap_or(own);
    let client = if header.is_empty() { identity.writer_guid } else { sample.writer_guid };
    Some((Asked { client, header, identity }, request))
}

/// Decodes a value that takes the whole payload, but for padding to four bytes.
pub(super) fn decode_all<T: DeserializeOwned>(encoding: [u8; 4], payload: &[u8]) -> Option<T> {
    let (value, consumed) = decode_payload::<T>(encoding, payload).ok()?;
    (payload.len().saturating_sub(consumed) < 4).then_some(value)
}

/// The value behind the header.
pub(super) fn encode<T: Serialize>(header: &[u8], value: &T) -> Option<RawCdr> {
    let mut body = Vec::new();
    to_writer_with_rep_id(&mut body, &Padded(value), RepresentationIdentifier::CDR_LE).ok()?;
    Some(RawCdr([&CDR_LE, header, &body].concat()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dds::large_replies::TO_BE_MATCHED;
    use crate::ros::alone::{node, outside};
    use crate::ros::endpoint::Plan;
    use crate::ros::topic::DdsTopic;
    use crate::wire::messages::{SuccessResponse, Trigger, TriggerRequest};
    use std::time::{Duration, Instant};

    #[tokio::test(flavor = "multi_thread")]
    async fn who_asks_and_is_gone_keeps_nobody_else_waiting() {
        if outside("ros::service::tests::who_asks_and_is_gone_keeps_nobody_else_waiting") {
            return;
        }
        const GONE: u32 = 40;
        let [(_one, mut server), (_other, mut user), (_third, gone)] = ["server", "user", "gone"].map(node);
        let answer = |_| SuccessResponse { success: true, message: String::new() };
        server.serve::<Trigger>("~/stop", answer).unwrap();
        let client = user.client::<Trigger>("/server/stop", Duration::from_secs(20)).await.unwrap();
        // They have no reader for the reply.
        let topic = DdsTopic::of_requests("/server/stop", Trigger::TYPE, qos());
        let requests = gone.participant().writer::<RawCdr>(Plan::unannounced(topic)).unwrap();
        let matches = gone.participant().matches();
        matches.wait_until(|matches| matches.count(requests.guid()) > 0).await;
        let request = encode(&[], &TriggerRequest::default()).unwrap();
        for _ in 0..GONE {
            requests.write_with(request.clone(), WriteOptionsBuilder::new().build()).await.unwrap();
        }
        tokio::time::sleep(TO_BE_MATCHED / 2).await;
        let begin = Instant::now();
        assert!(client.call(TriggerRequest::default()).await.unwrap().success);
        // One after the other they would take 20 s.
        assert!(begin.elapsed() < GONE * TO_BE_MATCHED / 4, "{:?}", begin.elapsed());
    }
}
