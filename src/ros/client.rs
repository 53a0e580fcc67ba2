//! Service clients that speak as the server's vendor expects.

use super::error::RosError;
use super::reader::Reader;
use super::service::{CYCLONE_HEADER, decode_all, encode};
use super::topic::{reply_topic, request_topic};
use super::writer::Writer;
use crate::dds::matches::Matches;
use crate::dds::raw_cdr::RawCdr;
use crate::dds::vendor::is_cyclone;
use crate::wire::messages::ServiceType;
use rustdds::{DomainParticipant, GUID, SampleIdentity, Timestamp, WriteOptionsBuilder};
use serde::Serialize;
use std::marker::PhantomData;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::Mutex;

/// A request is repeated after this long: the server may have heard it before it knew where to send the reply.
const REPEAT: Duration = Duration::from_millis(500);

/// A server's endpoints, and how it finds out which reply belongs to which request.
pub(super) struct ServerEndpoints {
    request_reader: GUID,
    reply_writer: GUID,
    /// By a header before the payload; others by the sample's identity.
    pub is_cyclone: bool,
}

/// Waits until a server of `service` is discovered.
pub(super) async fn find_server(
    participant: &DomainParticipant,
    service: &str,
    patience: Duration,
) -> Result<ServerEndpoints, RosError> {
    let search = async {
        loop {
            if let Some(endpoints) = discovered_server(participant, service) {
                return endpoints;
            }
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    };
    tokio::time::timeout(patience, search).await.map_err(|_| RosError::Service {
        service: service.to_owned(),
        why: format!(
            "no such service within {} s: is the node running, in this domain?",
            patience.as_secs_f64()
        ),
    })
}

fn discovered_server(participant: &DomainParticipant, service: &str) -> Option<ServerEndpoints> {
    let (request, reply) = (request_topic(service), reply_topic(service));
    let readers = participant.discovered_readers();
    let writers = participant.discovered_writers();
    let reader = readers.iter().find(|reader| *reader.subscription_topic_data.topic_name() == request)?;
    let writer = writers.iter().find(|writer| *writer.publication_topic_data.topic_name() == reply)?;
    let reply_writer = writer.writer_proxy.remote_writer_guid;
    Some(ServerEndpoints {
        request_reader: reader.reader_proxy.remote_reader_guid,
        reply_writer,
        is_cyclone: is_cyclone(reply_writer),
    })
}

/// The endpoints of a client, which its node keeps: the next client of that service is this one.
///
/// Secured, RustDDS has room for the keys of one endpoint only for each of its own and each remote participant. So a second client
/// of a service in one participant, even after the first has gone, gets no answer.
pub(super) struct Connection {
    requests: Writer<RawCdr>,
    replies: Reader<RawCdr>,
    /// Whether the server is Cyclone's.
    pub is_cyclone: bool,
    /// The number of the last request. Who waits for a reply takes the others' too: so one asks after the other.
    last: Mutex<i64>,
}

impl Connection {
    pub fn new(requests: Writer<RawCdr>, replies: Reader<RawCdr>, is_cyclone: bool) -> Arc<Self> {
        Arc::new(Self { requests, replies, is_cyclone, last: Mutex::new(0) })
    }

    /// Cyclone's header: half of the client's GUID and the request's number. The server sends it back as it is.
    fn header(&self, number: i64) -> [u8; CYCLONE_HEADER] {
        let mut header = [0; CYCLONE_HEADER];
        header[..8].copy_from_slice(&self.requests.guid().to_bytes()[8..]);
        header[8..].copy_from_slice(&number.to_le_bytes());
        header
    }

    /// Sends `request` again and again until one of these has its reply, which is the answer.
    async fn ask<S: ServiceType>(&self, last: &mut i64, request: &S::Request) -> Result<S::Response, String> {
        let mut asked = Vec::new();
        let mut repeat = tokio::time::interval(REPEAT);
        loop {
            tokio::select! {
                _ = repeat.tick() => {
                    *last += 1;
                    asked.push(self.send(*last, request).await?);
                }
                reply = self.replies.next() => {
                    // Replies to others, and to those before, come here too.
                    let Some((encoding, payload)) = reply.sample.parts() else { continue };
                    let related = reply.related_sample_identity();
                    let Some(body) = asked.iter().find_map(|asked| asked.body(payload, related)) else { continue };
                    return decode_all(encoding, body).ok_or_else(|| format!("a reply that is no {}", S::TYPE));
                }
            }
        }
    }

    async fn send(&self, number: i64, request: &impl Serialize) -> Result<Asked, String> {
        let header = if self.is_cyclone { self.header(number).to_vec() } else { Vec::new() };
        let request = encode(&header, request).ok_or("the request cannot be encoded")?;
        let options = WriteOptionsBuilder::new().source_timestamp(Timestamp::now()).build();
        let identity = self.requests.write_with(request, options).await?;
        Ok(Asked { header, identity })
    }
}

/// A request that was sent, and how its reply names it.
struct Asked {
    /// Of Cyclone's servers what comes back before the payload.
    header: Vec<u8>,
    /// Of the others what the reply's inline QoS names.
    identity: SampleIdentity,
}

impl Asked {
    /// The body of the reply's `payload`, where it is the reply to this.
    fn body<'a>(&self, payload: &'a [u8], related: Option<SampleIdentity>) -> Option<&'a [u8]> {
        match self.header.is_empty() {
            true => (related == Some(self.identity)).then_some(payload),
            false => payload.strip_prefix(self.header.as_slice()),
        }
    }
}

/// A client of one service.
pub struct Client<S: ServiceType> {
    connection: Arc<Connection>,
    service: String,
    patience: Duration,
    of: PhantomData<fn() -> S>,
}

impl<S: ServiceType> Client<S> {
    pub(super) async fn connect(
        connection: Arc<Connection>,
        service: String,
        server: ServerEndpoints,
        matches: &Matches,
        patience: Duration,
    ) -> Result<Self, RosError> {
        let matched = matches
            .wait_until(|now| now.has_remote(server.request_reader) && now.has_remote(server.reply_writer));
        let client = Self { connection, service, patience, of: PhantomData };
        tokio::time::timeout(patience, matched)
            .await
            .map_err(|_| client.error("the server was found but not matched"))?;
        Ok(client)
    }

    /// Calls the service; the request may be sent more than once, and the first reply to any of them counts.
    ///
    /// # Errors
    /// [`RosError::Service`] where no answer comes in time.
    pub async fn call(&self, request: S::Request) -> Result<S::Response, RosError> {
        let mut last = self.connection.last.lock().await;
        match tokio::time::timeout(self.patience, self.connection.ask::<S>(&mut last, &request)).await {
            Ok(answer) => answer.map_err(|why| self.error(&why)),
            Err(_) => Err(self.error(&format!("no answer within {} s", self.patience.as_secs_f64()))),
        }
    }

    fn error(&self, why: &str) -> RosError {
        RosError::Service { service: self.service.clone(), why: why.to_owned() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dds::first_sample_request::tests::guid;
    use crate::ros::Origin;
    use crate::ros::alone::{node, outside};
    use crate::wire::messages::{SetBool, SetBoolRequest, SuccessResponse};
    use rustdds::SequenceNumber;

    /// Longer than until a request is repeated.
    const SLOW: Duration = Duration::from_millis(800);

    #[tokio::test(flavor = "multi_thread")]
    async fn a_service_that_always_takes_long_is_answered_once_for_each_call() {
        if outside("ros::client::tests::a_service_that_always_takes_long_is_answered_once_for_each_call") {
            return;
        }
        let ((_one, mut server), (_other, mut user)) = (node("server"), node("user"));
        let answer = |SetBoolRequest { data }, _: &Origin| async move {
            tokio::time::sleep(SLOW).await;
            SuccessResponse { success: data, message: String::new() }
        };
        server.serve_later::<SetBool, _>("~/slow", answer).unwrap();
        let client = user.client::<SetBool>("/server/slow", Duration::from_secs(10)).await.unwrap();
        // The replies to the repetitions of each call come while the next one waits.
        for data in [true, false, true] {
            assert_eq!(client.call(SetBoolRequest { data }).await.unwrap().success, data);
        }
    }

    #[test]
    fn a_reply_is_that_to_the_request_that_it_names() {
        let identity = |number| SampleIdentity {
            writer_guid: guid([1; 16]),
            sequence_number: SequenceNumber::new(number),
        };
        let asked = |header: &[u8]| Asked { header: header.to_vec(), identity: identity(2) };
        let cyclone = |payload| asked(b"the second's head").body(payload, None);
        assert_eq!(cyclone(b"the second's headbody"), Some(b"body".as_slice()));
        assert_eq!(cyclone(b"the first's head  body"), None);
        let other = |number| asked(b"").body(b"body", number);
        assert_eq!(other(Some(identity(2))), Some(b"body".as_slice()));
        assert_eq!([other(Some(identity(1))), other(None)], [None; 2]);
    }
}
