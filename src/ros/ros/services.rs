//! Service servers that answer clients of every vendor.
//!
//! Clients on Fast DDS and RustDDS put the request's identity into the inline QoS of the sample ("enhanced" mapping). Clients on
//! Cyclone put a header of 16 bytes before the payload, and expect the same header in the reply. A server here distinguishes the
//! two kinds request by request. It receives payloads raw, and looks for the header in samples of Cyclone writers.

use super::endpoint_names::Origin;
use super::log::Logger;
use crate::dds::large_replies::{Addressee, ReplyWriter};
use crate::dds::matches::Matches;
use crate::dds::payload_padding::Padded;
use crate::dds::vendor::is_cyclone;
use dq_common::text::cut;
use dq_messages::messages::ServiceType;
use dq_messages::{CDR_BE, CDR_LE, decode_payload};
use futures::stream::{FuturesUnordered, StreamExt};
use ros2_client::{MessageInfo, RmwRequestId, Subscription};
use rustdds::serialization::to_writer_with_rep_id;
use rustdds::{GUID, RepresentationIdentifier, SequenceNumber};
use serde::de::{DeserializeOwned, SeqAccess, Visitor};
use serde::ser::SerializeTuple;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;
use std::pin::pin;

/// The length of the request header of Cyclone \[bytes\]: half of the client's GUID, and the sequence number.
pub(super) const CYCLONE_HEADER: usize = 16;

/// A payload in CDR, as bytes.
#[derive(Clone, Debug)]
pub(super) struct Payload(pub Vec<u8>);

impl ros2_client::Message for Payload {}

impl AsRef<[u8]> for Payload {
    fn as_ref(&self) -> &[u8] {
        &self.0
    }
}

impl Serialize for Payload {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        // In CDR a tuple of bytes is encoded as the bytes only: no length, no alignment.
        let mut tuple = serializer.serialize_tuple(self.0.len())?;
        self.0.iter().try_for_each(|byte| tuple.serialize_element(byte))?;
        tuple.end()
    }
}

impl<'de> Deserialize<'de> for Payload {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Bytes;
        impl<'de> Visitor<'de> for Bytes {
            type Value = Payload;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("bytes")
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut input: A) -> Result<Payload, A::Error> {
                // The payload ends where the input ends. CDR reports that end as an error.
                Ok(Payload(std::iter::from_fn(|| input.next_element().ok().flatten()).collect()))
            }
        }
        deserializer.deserialize_tuple(usize::MAX, Bytes)
    }
}

/// A service of a node.
pub(super) struct Service {
    pub name: String,
    /// A subscription to the requests, because the server of ros2-client does not report when a request was sent.
    pub requests: Subscription<Payload>,
    pub replies: ReplyWriter<Payload>,
    pub matches: Matches,
    pub log: Logger,
}

/// The largest number of requests that are answered at the same time. Further requests wait.
const AT_ONCE: usize = 100;

impl Service {
    /// Answers requests with `handler` forever. Calls the handler in the order of the requests. Answers do not wait for each other,
    /// so a client that has left delays only its own answer.
    pub async fn serve<S: ServiceType, F: Future<Output = S::Response>>(
        self,
        mut handler: impl FnMut(S::Request, &Origin) -> F,
    ) {
        let answer = async |id, header, response: F| {
            if let Err(why) = self.reply::<S>(id, header, response.await).await {
                self.log.error(&format!("{}: a reply could not be sent: {}", self.name, cut(&why)));
            }
        };
        let mut requests = pin!(self.requests.async_stream());
        let mut answers = FuturesUnordered::new();
        loop {
            let request = tokio::select! {
                Some(request) = requests.next(), if answers.len() < AT_ONCE => request,
                Some(()) = answers.next() => continue,
                else => return,
            };
            let Ok((payload, info)) = request else { continue };
            let id = request_id(&info);
            match decode::<S::Request>(id.writer_gid.into(), &payload.0) {
                Some((header, request)) => {
                    let response = handler(request, &Origin::new(&info, &self.matches));
                    answers.push(answer(id, header, response));
                }
                None => {
                    self.log.warn(&format!("{}: a request that is not a {} was ignored", self.name, S::TYPE))
                }
            }
        }
    }

    async fn reply<S: ServiceType>(
        &self,
        id: RmwRequestId,
        header: Vec<u8>,
        response: S::Response,
    ) -> Result<(), String> {
        let reply = encode_reply::<S>(&header, response, self.replies.room())?;
        let to_nobody =
            encode(&[0; CYCLONE_HEADER], &S::Response::default()).ok_or("nothing can be encoded")?;
        // A reply whose header has the request's identity does not need this identity in the inline QoS.
        let request = header.is_empty().then(|| id.into());
        self.replies.send(Addressee { client: id.writer_gid.into(), request }, reply, to_nobody).await
    }
}

/// Returns the identity of a request. The reply must repeat this identity, so that the client recognizes the reply.
fn request_id(info: &MessageInfo) -> RmwRequestId {
    let own = RmwRequestId { writer_gid: info.publisher_gid(), sequence_number: info.sequence_number() };
    let named = info.related_request_id().unwrap_or(own);
    // Fast DDS leaves the request's number unset if this number equals the sample's own sequence number.
    let is_left = named.sequence_number == i64::from(SequenceNumber::UNKNOWN);
    if is_left { RmwRequestId { sequence_number: own.sequence_number, ..named } } else { named }
}

/// Returns the encoded reply. If the reply exceeds `room` bytes, returns the substitute that the service defines.
fn encode_reply<S: ServiceType>(
    header: &[u8],
    response: S::Response,
    room: usize,
) -> Result<Payload, String> {
    let unencodable = || "it cannot be encoded".to_owned();
    let reply = encode(header, &response).ok_or_else(unencodable)?;
    let bytes = reply.0.len();
    if bytes <= room {
        return Ok(reply);
    }
    let excuse = S::too_long(response, bytes, room)
        .ok_or_else(|| format!("it has {bytes} bytes, and {room} can reach the client"))?;
    encode(header, &excuse).ok_or_else(unencodable)
}

/// Decodes a request. Returns the header that must precede the reply, and the decoded request. The header is empty unless the
/// client runs on Cyclone.
fn decode<T: DeserializeOwned>(client: GUID, payload: &[u8]) -> Option<(Vec<u8>, T)> {
    let with_header = is_cyclone(client)
        .then(|| payload.split_at_checked(CYCLONE_HEADER))
        .flatten()
        .and_then(|(header, body)| Some((header.to_vec(), decode_all(body)?)));
    with_header.or_else(|| Some((Vec::new(), decode_all(payload)?)))
}

/// Decodes a value that fills the payload, apart from padding to four bytes. ros2-client does not report the byte order, so this
/// function tries little endian first, then big endian.
pub(super) fn decode_all<T: DeserializeOwned>(payload: &[u8]) -> Option<T> {
    [CDR_LE, CDR_BE].into_iter().find_map(|encoding| {
        let (value, consumed) = decode_payload::<T>(encoding, payload).ok()?;
        (payload.len().saturating_sub(consumed) < 4).then_some(value)
    })
}

/// Encodes `value`, and puts `header` before it.
pub(super) fn encode<T: Serialize>(header: &[u8], value: &T) -> Option<Payload> {
    let mut body = Vec::new();
    to_writer_with_rep_id(&mut body, &Padded(value), RepresentationIdentifier::CDR_LE).ok()?;
    Some(Payload([header, &body].concat()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::alone::{node, outside};
    use crate::dds::large_replies::TO_BE_MATCHED;
    use crate::ros::graph::request_topic;
    use dq_messages::messages::{SuccessResponse, Trigger, TriggerRequest};
    use rustdds::{CDRSerializerAdapter, QosPolicies, RTPSEntity, TopicKind};
    use std::time::{Duration, Instant};

    #[tokio::test(flavor = "multi_thread")]
    async fn a_client_that_disconnects_after_a_request_delays_no_other() {
        if outside("ros::services::tests::a_client_that_disconnects_after_a_request_delays_no_other") {
            return;
        }
        const GONE: u32 = 40;
        let [(_one, mut server), (_other, mut user), (_third, gone)] = ["server", "user", "gone"].map(node);
        let answer = |_| SuccessResponse { success: true, message: String::new() };
        server.serve::<Trigger>("~/stop", answer).unwrap();
        let client = user.client::<Trigger>("/server/stop", Duration::from_secs(20)).await.unwrap();
        // These requests have no reader for the reply.
        let domain = gone.domain();
        let (name, kind) = (request_topic("/server/stop"), "std_srvs::srv::dds_::Trigger_Request_");
        let qos = QosPolicies::builder().reliable(rustdds::Duration::ZERO).build();
        let topic = domain.dds.create_topic(name, kind.to_owned(), &qos, TopicKind::NoKey).unwrap();
        let publisher = domain.dds.create_publisher(&qos).unwrap();
        let requests =
            publisher.create_datawriter_no_key::<Payload, CDRSerializerAdapter<_>>(&topic, None).unwrap();
        domain.matches.wait_until(|matches| matches.count(requests.guid()) > 0).await;
        let request = encode(&[], &TriggerRequest::default()).unwrap();
        (0..GONE).for_each(|_| requests.write(request.clone(), None).unwrap());
        tokio::time::sleep(TO_BE_MATCHED / 2).await;
        let begin = Instant::now();
        assert!(client.call(TriggerRequest::default()).await.unwrap().success);
        // If the answers waited for each other, they would take 20 s.
        assert!(begin.elapsed() < GONE * TO_BE_MATCHED / 4, "{:?}", begin.elapsed());
    }
}
