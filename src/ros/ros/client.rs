//! Service clients. A client finds the reply to its request by the rules of the server's DDS vendor.

use super::error::RosError;
use super::graph::{reply_topic, request_topic};
use super::services::{Payload, decode_all, encode};
use crate::dds::matches::Matches;
use crate::dds::vendor::is_cyclone;
use dq_messages::messages::ServiceType;
use ros2_client::{RmwRequestId, ServiceMapping};
use rustdds::{DomainParticipant, GUID};
use std::marker::PhantomData;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::Mutex;

/// The time after which a request is sent again. If the server receives the first request before it has matched our reader of
/// replies, the reply is lost.
const REPEAT: Duration = Duration::from_millis(500);

/// The time between two checks for a reply.
const LOOK: Duration = Duration::from_millis(1);

/// The largest number of replies that are read per check.
const MOST_REPLIES: usize = 100;

/// The endpoints of a server, and how the server assigns replies to requests.
pub(super) struct ServerEndpoints {
    request_reader: GUID,
    reply_writer: GUID,
    pub mapping: ServiceMapping,
}

/// Waits up to `patience` until a server of `service` is discovered.
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
        mapping: if is_cyclone(reply_writer) { ServiceMapping::Cyclone } else { ServiceMapping::Enhanced },
    })
}

/// The client of ros2-client for one service. The node stores it, and all [`Client`]s of that service share it.
///
/// In a secured graph, a second client of the same service in one participant would get no answer, even after the first client has
/// gone. The reason is in RustDDS: for each local endpoint, it stores the keys of only one endpoint of each remote participant.
pub(super) struct Connection {
    inner: ros2_client::Client<Payload, Payload>,
    mapping: ServiceMapping,
    /// Each call holds this lock while it waits, because a waiting call also takes the replies to other calls.
    turn: Mutex<()>,
}

impl Connection {
    pub fn new(inner: ros2_client::Client<Payload, Payload>, mapping: ServiceMapping) -> Arc<Self> {
        Arc::new(Self { inner, mapping, turn: Mutex::new(()) })
    }

    /// Returns whether the client uses this mapping.
    pub fn speaks(&self, mapping: ServiceMapping) -> bool {
        self.mapping == mapping
    }

    /// Repeats `request` until a reply to one of the repetitions arrives, and returns that reply. Polls for replies, because
    /// ros2-client can only wait for the reply to one request, and then drops all other replies.
    async fn ask<S: ServiceType>(&self, request: &S::Request) -> Result<S::Response, String> {
        let request = encode(&[], request).ok_or("the request cannot be encoded")?;
        let (mut repeat, mut look) = (tokio::time::interval(REPEAT), tokio::time::interval(LOOK));
        let mut asked = Vec::new();
        loop {
            tokio::select! {
                _ = repeat.tick() => {
                    let sent = self.inner.async_send_request(request.clone()).await;
                    asked.push(sent.map_err(|why| why.to_string())?);
                }
                _ = look.tick() => {
                    if let Some(reply) = self.reply(&asked) {
                        return decode_all(&reply.0).ok_or_else(|| format!("a reply that is not a {}", S::TYPE));
                    }
                }
            }
        }
    }

    /// Returns the reply to one of the requests `asked`; `None` if no such reply has arrived. Drops replies to earlier requests and
    /// to the requests of other clients.
    fn reply(&self, asked: &[RmwRequestId]) -> Option<Payload> {
        let mut replies =
            (0..MOST_REPLIES).map_while(|_| self.inner.receive_response().transpose()).flatten();
        replies.find(|(to, _)| asked.contains(to)).map(|(_, reply)| reply)
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

    /// Calls the service. The request may be sent more than once; the first reply counts.
    ///
    /// # Errors
    /// [`RosError::Service`] if no answer arrives in time.
    pub async fn call(&self, request: S::Request) -> Result<S::Response, RosError> {
        let _turn = self.connection.turn.lock().await;
        match tokio::time::timeout(self.patience, self.connection.ask::<S>(&request)).await {
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
    use crate::alone::{node, outside};
    use dq_messages::messages::{SetBool, SetBoolRequest, SuccessResponse};

    /// How long the server takes to answer: longer than [`REPEAT`], so that the client repeats each request.
    const SLOW: Duration = Duration::from_millis(800);

    #[tokio::test(flavor = "multi_thread")]
    async fn a_service_that_always_takes_long_is_answered_once_for_each_call() {
        if outside("ros::client::tests::a_service_that_always_takes_long_is_answered_once_for_each_call") {
            return;
        }
        let ((_one, mut server), (_other, mut user)) = (node("server"), node("user"));
        let answer = |SetBoolRequest { data }| async move {
            tokio::time::sleep(SLOW).await;
            SuccessResponse { success: data, message: String::new() }
        };
        server.serve_later::<SetBool, _>("~/slow", answer).unwrap();
        let client = user.client::<SetBool>("/server/slow", Duration::from_secs(10)).await.unwrap();
        // The replies to repetitions of each call arrive while the next call waits.
        for data in [true, false, true] {
            assert_eq!(client.call(SetBoolRequest { data }).await.unwrap().success, data);
        }
    }
}
