//! Finds the nodes that own publishers and subscriptions, by the announcements of all ROS 2 participants on `ros_discovery_info`.

use super::error::RosError;
use super::release::{BUILT_FOR, Release};
use crate::dds::matches::{Matches, Owners};
use crate::dds::raw_subscription::Undecoded;
use dq_messages::decode_payload;
use futures::StreamExt;
use ros2_client::MessageInfo;
use ros2_client::builtin_topics::ros_discovery::{QOS_PUB, TOPIC_NAME, TYPE_NAME};
use rustdds::no_key::SimpleDataReader;
use rustdds::{DomainParticipant, GUID, QosPolicies, TopicKind};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use std::collections::{BTreeMap, VecDeque};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// The largest number of participants that are remembered. The oldest participant is forgotten first.
const PARTICIPANTS: usize = 256;

/// The message `rmw_dds_common/msg/ParticipantEntitiesInfo`. The type of this name in ros2-client hides the endpoints, and supports
/// GIDs of only one length.
#[derive(Deserialize)]
struct ParticipantEntitiesInfo<G> {
    gid: G,
    nodes: Vec<NodeEntitiesInfo<G>>,
}

/// The message `rmw_dds_common/msg/NodeEntitiesInfo`.
#[derive(Deserialize)]
struct NodeEntitiesInfo<G> {
    namespace: String,
    name: String,
    readers: Vec<G>,
    writers: Vec<G>,
}

/// The content of a participant's announcement: its GUID, and its endpoints with the names of their nodes.
#[derive(Debug, PartialEq)]
struct Announcement {
    participant: [u8; 16],
    endpoints: Vec<([u8; 16], String)>,
}

impl Announcement {
    /// Decodes an announcement of any ROS 2 release. `cdr` begins with the encapsulation header. Returns `None` if the announcement
    /// is not valid.
    fn decode(cdr: &[u8]) -> Option<(Self, Release)> {
        let recent = || Some((Self::from(whole::<ParticipantEntitiesInfo<[u8; 16]>>(cdr)?), Release::Jazzy));
        let old = || Some((Self::from(whole::<ParticipantEntitiesInfo<[u8; 24]>>(cdr)?), Release::Humble));
        recent().or_else(old)
    }
}

impl<G: AsRef<[u8]>> From<ParticipantEntitiesInfo<G>> for Announcement {
    fn from(info: ParticipantEntitiesInfo<G>) -> Self {
        let of_node = |node: NodeEntitiesInfo<G>| {
            let name = format!("{}/{}", node.namespace.trim_end_matches('/'), node.name);
            node.writers.into_iter().chain(node.readers).map(move |endpoint| (guid(&endpoint), name.clone()))
        };
        Self { participant: guid(&info.gid), endpoints: info.nodes.into_iter().flat_map(of_node).collect() }
    }
}

/// Returns the DDS GUID at the beginning of `gid`. Older releases add zeros after the GUID.
fn guid(gid: &impl AsRef<[u8]>) -> [u8; 16] {
    gid.as_ref().first_chunk().copied().unwrap_or_default()
}

/// Decodes a value of type `V` from `cdr`. Ignores up to three bytes of padding at the end. If more bytes remain, the GIDs in `cdr`
/// are longer than those of `V`; then this function returns `None`.
fn whole<V: DeserializeOwned>(cdr: &[u8]) -> Option<V> {
    let (header, payload) = cdr.split_first_chunk()?;
    let (value, used) = decode_payload(*header, payload).ok()?;
    (payload.len().saturating_sub(used) < 4).then_some(value)
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
    /// When the message was sent \[ns since 1970\], by the sender's clock; `None` if unknown.
    pub sent: Option<i64>,
    matches: &'a Matches,
}

impl<'a> Origin<'a> {
    pub(super) fn new(info: &MessageInfo, matches: &'a Matches) -> Self {
        let publisher = EndpointId(info.publisher_gid().to_bytes16());
        Self { publisher, sent: info.source_timestamp().map(|time| time.to_nanos()), matches }
    }

    /// Returns the time since the publisher was first discovered; `None` if the publisher may be older than this process.
    pub fn known_for(&self) -> Option<Duration> {
        self.matches.known_for(self.publisher.guid())
    }
}

/// The reader of the announcements in a domain.
pub(super) type Announcements = SimpleDataReader<Undecoded, Undecoded>;

/// Creates a reader of the announcements of all participants. The reader also gets the latest earlier announcement of each
/// participant, because the topic is latched.
///
/// # Errors
/// [`RosError::Create`].
pub(super) fn announcements(dds: &DomainParticipant) -> Result<Announcements, RosError> {
    let reader = || {
        let topic =
            dds.create_topic(TOPIC_NAME.to_owned(), TYPE_NAME.to_owned(), &QOS_PUB, TopicKind::NoKey)?;
        let subscriber = dds.create_subscriber(&QosPolicies::qos_none())?;
        subscriber.create_simple_datareader_no_key(&topic, None)
    };
    reader().map_err(|why| RosError::create(TOPIC_NAME)(&why))
}

/// The names of the nodes that own the endpoints in the graph, as far as participants have announced them.
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
    /// Returns a description of the endpoint: its node's name, if known, and its GUID.
    pub fn describe(&self, endpoint: EndpointId) -> String {
        match self.lock().node_of(endpoint) {
            Some(node) => format!("{node} ({endpoint})"),
            None => format!("an unknown node ({endpoint})"),
        }
    }

    /// Processes the announcements forever. Calls `warn` once: when the first announcement arrives from a participant whose release
    /// of ROS 2 is not the one for which this program was built.
    pub(super) async fn follow(self, announcements: Announcements, warn: impl FnOnce(Release)) {
        let (mut announcements, mut warn) = (std::pin::pin!(announcements.as_async_stream()), Some(warn));
        while let Some(announced) = announcements.next().await {
            // Announcements that cannot be decoded are ignored.
            let decoded = announced.ok().and_then(|sample| Announcement::decode(&sample.into_value().0));
            let Some((announcement, release)) = decoded else { continue };
            self.lock().take(announcement);
            if release != BUILT_FOR
                && let Some(warn) = warn.take()
            {
                warn(release);
            }
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

    fn take(&mut self, Announcement { participant, endpoints }: Announcement) {
        if self.nodes.insert(participant, endpoints).is_none() {
            self.order.push_back(participant);
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

    /// Returns the bytes of an announcement as ROS 2's middleware writes it, with GIDs of `length` bytes.
    fn announced(length: usize, participant: u8, writer: u8, name: &str) -> Vec<u8> {
        let gid = |byte| [vec![byte; 16], vec![0; length - 16]].concat();
        let name = [(name.len() as u32 + 1).to_le_bytes().as_slice(), name.as_bytes(), &[0]].concat();
        let padding = vec![0; name.len().next_multiple_of(4) - name.len()];
        let (one, none, left) = ([1, 0, 0, 0], [0; 4], b"\x06\0\0\0/left\0\0\0");
        let parts: [&[u8]; 9] =
            [&[0, 1, 0, 0], &gid(participant), &one, left, &name, &padding, &none, &one, &gid(writer)];
        parts.concat()
    }

    fn announce(participant: u8, writer: u8, name: &str) -> Announcement {
        Announcement::decode(&announced(16, participant, writer, name)).unwrap().0
    }

    #[test]
    fn announcements_of_both_lengths_are_told_apart() {
        let endpoints = vec![([7; 16], "/left/driver".to_owned())];
        let expected = Announcement { participant: [1; 16], endpoints };
        for (length, release) in [(16, Release::Jazzy), (24, Release::Humble)] {
            let bytes = announced(length, 1, 7, "driver");
            let (announcement, found) = Announcement::decode(&bytes).unwrap();
            assert_eq!((&announcement, found), (&expected, release));
            // A participant without nodes.
            let empty = [&bytes[..4 + length], &[0; 4]].concat();
            assert_eq!(Announcement::decode(&empty).unwrap().1, release);
            assert_eq!(Announcement::decode(&bytes[..bytes.len() - 1]), None);
        }
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
