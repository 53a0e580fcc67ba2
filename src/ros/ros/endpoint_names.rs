//! The owners of publishers and subscriptions, from the announcements of all ROS 2 participants on `ros_discovery_info`.

use super::error::RosError;
use crate::dds::matches::{Matches, Owners};
use futures::StreamExt;
use ros2_client::MessageInfo;
use ros2_client::builtin_topics::ros_discovery::{QOS_PUB, TOPIC_NAME, TYPE_NAME};
use rustdds::no_key::SimpleDataReaderCdr;
use rustdds::{CDRDeserializerAdapter, DomainParticipant, GUID, QosPolicies, TopicKind};
use serde::Deserialize;
use std::collections::{BTreeMap, VecDeque};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// The number of participants that are remembered; the oldest is forgotten first.
const PARTICIPANTS: usize = 256;

/// `rmw_dds_common/msg/ParticipantEntitiesInfo`. ros2-client has a type of this name, but that type does not show the endpoints.
#[derive(Clone, Deserialize)]
pub(super) struct ParticipantEntitiesInfo {
    gid: [u8; 16],
    nodes: Vec<NodeEntitiesInfo>,
}

/// `rmw_dds_common/msg/NodeEntitiesInfo`.
#[derive(Clone, Deserialize)]
struct NodeEntitiesInfo {
    namespace: String,
    name: String,
    readers: Vec<[u8; 16]>,
    writers: Vec<[u8; 16]>,
}

/// A publisher or subscription in the domain, identified by its DDS GUID.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct EndpointId([u8; 16]);

impl EndpointId {
    /// Returns the GUID of the endpoint.
    pub(super) fn guid(self) -> GUID {
        GUID::from_bytes(self.0)
    }
}

impl From<GUID> for EndpointId {
    fn from(guid: GUID) -> Self {
        Self(guid.to_bytes())
    }
}

impl std::fmt::Display for EndpointId {
    /// Formats the GUID like `ros2 topic info -v`: bytes in hexadecimal, separated by dots.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for (i, byte) in self.0.iter().enumerate() {
            write!(f, "{}{byte:02x}", if i > 0 { "." } else { "" })?;
        }
        Ok(())
    }
}

impl Owners for EndpointNames {
    fn knows(&self, endpoint: GUID) -> bool {
        self.lock().node_of(endpoint.into()).is_some()
    }

    fn describe(&self, endpoint: GUID) -> String {
        EndpointNames::describe(self, endpoint.into())
    }
}

/// The sender of a message, and the time of sending.
#[derive(Clone, Copy)]
pub struct Origin<'a> {
    /// The publisher.
    pub publisher: EndpointId,
    /// The time at which the message was sent by the sender's clock \[ns since 1970\], if known.
    pub sent: Option<i64>,
    matches: &'a Matches,
}

impl<'a> Origin<'a> {
    pub(super) fn new(info: &MessageInfo, matches: &'a Matches) -> Self {
        let publisher = EndpointId(info.publisher_gid().to_bytes16());
        Self { publisher, sent: info.source_timestamp().map(|time| time.to_nanos()), matches }
    }

    /// Returns for how long the publisher has been known; `None` if it may have existed before this process.
    pub fn known_for(&self) -> Option<Duration> {
        self.matches.known_for(self.publisher.guid())
    }
}

/// The reader of the announcements in a domain.
pub(super) type Announcements = SimpleDataReaderCdr<ParticipantEntitiesInfo>;

/// Creates a reader of the announcements of all participants. The last announcement of each participant is latched.
///
/// # Errors
/// [`RosError::Create`].
pub(super) fn announcements(dds: &DomainParticipant) -> Result<Announcements, RosError> {
    let reader = || {
        let topic =
            dds.create_topic(TOPIC_NAME.to_owned(), TYPE_NAME.to_owned(), &QOS_PUB, TopicKind::NoKey)?;
        let subscriber = dds.create_subscriber(&QosPolicies::qos_none())?;
        subscriber.create_simple_datareader_no_key::<_, CDRDeserializerAdapter<_>>(&topic, None)
    };
    reader().map_err(|why| RosError::create(TOPIC_NAME)(&why))
}

/// The names of the nodes in the domain by their endpoints. Only announced nodes are known.
#[derive(Clone, Default)]
pub struct EndpointNames {
    state: Arc<Mutex<State>>,
}

#[derive(Default)]
struct State {
    /// The endpoints of each participant, with the names of their nodes.
    nodes: BTreeMap<[u8; 16], Vec<([u8; 16], String)>>,
    order: VecDeque<[u8; 16]>,
}

impl EndpointNames {
    /// Returns a description of the endpoint: the name of its node if known, and its GUID.
    pub fn describe(&self, endpoint: EndpointId) -> String {
        match self.lock().node_of(endpoint) {
            Some(node) => format!("{node} ({endpoint})"),
            None => format!("an unknown node ({endpoint})"),
        }
    }

    /// Processes the announcements forever.
    pub(super) async fn follow(self, announcements: Announcements) {
        let mut announcements = std::pin::pin!(announcements.as_async_stream());
        while let Some(announced) = announcements.next().await {
            // Announcements that cannot be decoded are ignored.
            announced.into_iter().for_each(|announced| self.lock().take(announced.into_value()));
        }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        // No code panics while it holds the lock.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl State {
    fn node_of(&self, endpoint: EndpointId) -> Option<&str> {
        let mut endpoints = self.nodes.values().flatten();
        endpoints.find(|(guid, _)| EndpointId(*guid) == endpoint).map(|(_, node)| node.as_str())
    }

    fn take(&mut self, info: ParticipantEntitiesInfo) {
        let of_node = |node: NodeEntitiesInfo| {
            let name = format!("{}/{}", node.namespace.trim_end_matches('/'), node.name);
            node.writers.into_iter().chain(node.readers).map(move |endpoint| (endpoint, name.clone()))
        };
        let endpoints = info.nodes.into_iter().flat_map(of_node).collect();
        if self.nodes.insert(info.gid, endpoints).is_none() {
            self.order.push_back(info.gid);
        }
        if self.order.len() > PARTICIPANTS
            && let Some(oldest) = self.order.pop_front()
        {
            self.nodes.remove(&oldest);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn announce(participant: u8, writer: u8, name: &str) -> ParticipantEntitiesInfo {
        let node = NodeEntitiesInfo {
            namespace: "/left".to_owned(),
            name: name.to_owned(),
            readers: Vec::new(),
            writers: vec![[writer; 16]],
        };
        ParticipantEntitiesInfo { gid: [participant; 16], nodes: vec![node] }
    }

    #[test]
    fn endpoints_have_the_names_of_their_nodes() {
        let names = EndpointNames::default();
        names.lock().take(announce(1, 7, "driver"));
        names.lock().take(announce(2, 8, "simulator"));
        let guid = "07.07.07.07.07.07.07.07.07.07.07.07.07.07.07.07";
        assert_eq!(names.describe(EndpointId([7; 16])), format!("/left/driver ({guid})"));
        assert!(names.describe(EndpointId([8; 16])).starts_with("/left/simulator"));
        assert!(names.describe(EndpointId([9; 16])).starts_with("an unknown node (09."));
    }
}
