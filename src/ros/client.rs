//! Service clients that speak as the server's vendor expects.

use super::error::RosError;
use super::matches::Matches;
use super::padded::Padded;
use super::service::CYCLONE_VENDOR;
use crate::wire::messages::ServiceType;
use ros2_client::ServiceMapping;
use rustdds::{DomainParticipant, GUID};
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::Mutex;

/// A request is repeated after this long: the server may have heard it before it knew where to send the reply.
const REPEAT: Duration = Duration::from_millis(500);

/// A server's endpoints, and how it maps services to topics.
pub(super) struct ServerEndpoints {
    request_reader: GUID,
    reply_writer: GUID,
    pub mapping: ServiceMapping,
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
    let (request, reply) = (format!("rq{service}Request"), format!("rr{service}Reply"));
    let readers = participant.discovered_readers();
    let writers = participant.discovered_writers();
    let reader = readers.iter().find(|reader| *reader.subscription_topic_data.topic_name() == request)?;
    let writer = writers.iter().find(|writer| *writer.publication_topic_data.topic_name() == reply)?;
    let reply_writer = writer.writer_proxy.remote_writer_guid;
    let cyclone = reply_writer.to_bytes()[..2] == CYCLONE_VENDOR;
    Some(ServerEndpoints {
        request_reader: reader.reader_proxy.remote_reader_guid,
        reply_writer,
        mapping: if cyclone { ServiceMapping::Cyclone } else { ServiceMapping::Enhanced },
    })
}

type PaddedClient<S> =
    ros2_client::Client<Padded<<S as ServiceType>::Request>, Padded<<S as ServiceType>::Response>>;

/// The endpoints of a client, which its node keeps: the next client of that service is this one.
///
/// Secured, RustDDS has room for the keys of one endpoint only for each of its own and each remote participant. So a second client
/// of a service in one participant, even after the first has gone, gets no answer.
pub(super) struct Connection<S: ServiceType> {
    pub mapping: ServiceMapping,
    // Who waits for a reply takes the others' too.
    inner: Mutex<PaddedClient<S>>,
}

/// A client of one service.
pub struct Client<S: ServiceType> {
    connection: Arc<Connection<S>>,
    service: String,
    patience: Duration,
}

impl<S: ServiceType> Connection<S> {
    pub fn new(inner: PaddedClient<S>, mapping: ServiceMapping) -> Arc<Self> {
        Arc::new(Self { mapping, inner: Mutex::new(inner) })
    }
}

impl<S: ServiceType> Client<S> {
    pub(super) async fn connect(
        connection: Arc<Connection<S>>,
        service: String,
        server: ServerEndpoints,
        matches: &Matches,
        patience: Duration,
    ) -> Result<Self, RosError> {
        let matched = matches
            .wait_until(|now| now.has_remote(server.request_reader) && now.has_remote(server.reply_writer));
        let client = Self { connection, service, patience };
        tokio::time::timeout(patience, matched)
            .await
            .map_err(|_| client.error("the server was found but not matched"))?;
        Ok(client)
    }

    /// Calls the service; the request may be sent more than once.
    ///
    /// # Errors
    /// [`RosError::Service`] where no answer comes in time.
    pub async fn call(&self, request: S::Request) -> Result<S::Response, RosError> {
        let inner = self.connection.inner.lock().await;
        let attempts = self.patience.as_millis().div_ceil(REPEAT.as_millis()).max(1);
        for _ in 0..attempts {
            let call = inner.async_call_service(Padded(request.clone()));
            match tokio::time::timeout(REPEAT, call).await {
                Ok(Ok(Padded(response))) => return Ok(response),
                Ok(Err(why)) => return Err(self.error(&why.to_string())),
                Err(_) => {}
            }
        }
        Err(self.error(&format!("no answer within {} s", self.patience.as_secs_f64())))
    }

    fn error(&self, why: &str) -> RosError {
        RosError::Service { service: self.service.clone(), why: why.to_owned() }
    }
}
