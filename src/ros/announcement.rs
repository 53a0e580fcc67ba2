//! Which endpoints are whose: what this participant announces of its nodes on `ros_discovery_info`, as every ROS 2 participant does.

use super::graph::{NodeEntitiesInfo, ParticipantEntitiesInfo};
use super::names::NodeName;
use super::padded::Padded;
use super::participant::DdsTopic;
use rustdds::no_key::DataWriterCdr;
use rustdds::policy::{Durability, History, Reliability};
use rustdds::{Duration, GUID, QosPolicyBuilder};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError, Weak};

/// The topic of announcements, which has no prefix.
const TOPIC: &str = "ros_discovery_info";

/// What this participant says of its nodes.
pub(super) struct Announcement {
    participant: [u8; 16],
    writer: DataWriterCdr<Padded<ParticipantEntitiesInfo>>,
    /// By their fully qualified names.
    nodes: Mutex<BTreeMap<String, NodeEntitiesInfo>>,
}

/// The two kinds of endpoints.
#[derive(Clone, Copy)]
pub(super) enum Kind {
    Reader,
    Writer,
}

impl Announcement {
    /// The topic on which participants announce their nodes: the last word of each counts, for late joiners too.
    pub fn topic() -> DdsTopic<'static> {
        DdsTopic {
            ros_name: TOPIC,
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
    pub fn new(participant: GUID, writer: DataWriterCdr<Padded<ParticipantEntitiesInfo>>) -> Self {
        Self { participant: participant.to_bytes(), writer, nodes: Mutex::default() }
    }

    /// Announces the node, with nothing of its own yet.
    pub fn add(&self, node: &NodeName) {
        let empty = NodeEntitiesInfo::new(node.namespace(), node.name());
        self.change(|nodes| drop(nodes.insert(node.fully_qualified(), empty)));
    }

    /// Announces that the node has gone.
    pub fn remove(&self, node: &NodeName) {
        self.change(|nodes| drop(nodes.remove(&node.fully_qualified())));
    }

    /// Announces an endpoint of the node until the answer is dropped.
    pub fn announce(self: &Arc<Self>, node: &NodeName, kind: Kind, endpoint: GUID) -> Announced {
        let (node, endpoint) = (node.fully_qualified(), endpoint.to_bytes());
        self.change(|nodes| {
            if let Some(info) = nodes.get_mut(&node) {
                info.endpoints(kind).push(endpoint);
            }
        });
        Announced { announcement: Arc::downgrade(self), node, kind, endpoint }
    }

    fn change(&self, change: impl FnOnce(&mut BTreeMap<String, NodeEntitiesInfo>)) {
        // Nothing panics while it holds the lock; announcements leave in the order of the changes.
        let mut nodes = self.nodes.lock().unwrap_or_else(PoisonError::into_inner);
        let before = nodes.clone();
        change(&mut nodes);
        if *nodes != before {
            let info = ParticipantEntitiesInfo::new(self.participant, nodes.values().cloned().collect());
            // One that finds no room is followed by others, and says no more than they do.
            let _ = self.writer.write(Padded(info), Some(rustdds::Timestamp::now()));
        }
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
            announcement.change(|nodes| {
                if let Some(info) = nodes.get_mut(&self.node) {
                    info.endpoints(self.kind).retain(|endpoint| *endpoint != self.endpoint);
                }
            });
        }
    }
}
