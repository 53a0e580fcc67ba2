//! Which endpoints are whose: what this participant announces of its nodes on `ros_discovery_info`, as every ROS 2 participant does.

use super::endpoint::Kind;
use super::graph::{NodeEntitiesInfo, ParticipantEntitiesInfo};
use super::names::NodeName;
use super::topic::DdsTopic;
use super::writer::Writer;
use crate::dds::payload_padding::Padded;
use rustdds::policy::{Durability, History, Reliability};
use rustdds::{Duration, GUID, QosPolicyBuilder};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use tokio::sync::Notify;

/// The topic of announcements, which has no prefix.
const TOPIC: &str = "ros_discovery_info";

/// What comes to a node within this time is announced together: each announcement goes to every participant of the domain, and a node
/// makes some thirty endpoints as it starts.
const GATHERING: std::time::Duration = std::time::Duration::from_millis(50);

/// What this participant says of its nodes.
pub(super) struct Announcement {
    participant: [u8; 16],
    writer: Writer<Padded<ParticipantEntitiesInfo>>,
    nodes: Mutex<Nodes>,
    changed: Notify,
}

/// Nodes by their fully qualified names.
#[derive(Default)]
struct Nodes {
    present: BTreeMap<String, NodeEntitiesInfo>,
    announced: BTreeMap<String, NodeEntitiesInfo>,
}

impl Announcement {
    /// The topic on which participants announce their nodes: the last word of each counts, for late joiners too.
    pub fn topic() -> DdsTopic {
        DdsTopic {
            ros_name: TOPIC.to_owned(),
            name: TOPIC.to_owned(),
            type_name: "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_".to_owned(),
            qos: QosPolicyBuilder::new()
                .reliability(Reliability::Reliable { max_blocking_time: Duration::ZERO })
                .durability(Durability::TransientLocal)
                .history(History::KeepLast { depth: 1 })
                .build(),
        }
    }

    /// Of a participant that has no nodes yet.
    pub fn new(participant: GUID, writer: Writer<Padded<ParticipantEntitiesInfo>>) -> Self {
        Self { participant: participant.to_bytes(), writer, nodes: Mutex::default(), changed: Notify::new() }
    }

    /// Announces what changes, for ever.
    pub async fn follow(self: Arc<Self>) {
        loop {
            self.changed.notified().await;
            tokio::time::sleep(GATHERING).await;
            self.publish(&mut self.lock());
        }
    }

    /// Announces the node, with nothing of its own yet.
    pub fn add(&self, node: &NodeName) {
        let empty = NodeEntitiesInfo::new(node.namespace(), node.name());
        self.lock().present.insert(node.fully_qualified(), empty);
        self.changed.notify_one();
    }

    /// Announces that the node has gone, now: the process may be about to end.
    pub fn remove(&self, node: &NodeName) {
        let mut nodes = self.lock();
        nodes.present.remove(&node.fully_qualified());
        self.publish(&mut nodes);
    }

    /// Announces an endpoint of the node until the answer is dropped.
    pub fn announce(self: &Arc<Self>, node: &NodeName, kind: Kind, endpoint: GUID) -> Announced {
        let (node, endpoint) = (node.fully_qualified(), endpoint.to_bytes());
        self.change(&node, kind, |endpoints| endpoints.push(endpoint));
        Announced { announcement: Arc::downgrade(self), node, kind, endpoint }
    }

    /// Changes the endpoints of that kind that the node has, if it is there.
    fn change(&self, node: &str, kind: Kind, change: impl FnOnce(&mut Vec<[u8; 16]>)) {
        if let Some(info) = self.lock().present.get_mut(node) {
            change(info.endpoints(kind));
            self.changed.notify_one();
        }
    }

    /// Announces what has not been announced; in the order of the changes, by the lock.
    fn publish(&self, nodes: &mut Nodes) {
        if nodes.present != nodes.announced {
            nodes.announced = nodes.present.clone();
            let info =
                ParticipantEntitiesInfo::new(self.participant, nodes.present.values().cloned().collect());
            // One that finds no room is followed by others, and says no more than they do.
            self.writer.write(Padded(info));
        }
    }

    fn lock(&self) -> MutexGuard<'_, Nodes> {
        // Nothing panics while it holds the lock.
        self.nodes.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// An endpoint that is announced as its node's, as long as this lives.
pub(super) struct Announced {
    announcement: Weak<Announcement>,
    node: String,
    kind: Kind,
    endpoint: [u8; 16],
}

impl Drop for Announced {
    fn drop(&mut self) {
        if let Some(announcement) = self.announcement.upgrade() {
            let is_other = |endpoint: &[u8; 16]| *endpoint != self.endpoint;
            announcement.change(&self.node, self.kind, |endpoints| endpoints.retain(is_other));
        }
    }
}
