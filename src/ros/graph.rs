//! Whose publishers are whose: what every ROS 2 participant announces of its nodes on `ros_discovery_info`.

use super::topics::PublisherId;
use futures::StreamExt;
use serde::Deserialize;
use std::collections::{BTreeMap, VecDeque};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Participants that are remembered; the oldest goes first.
const PARTICIPANTS: usize = 256;

/// `rmw_dds_common/msg/ParticipantEntitiesInfo`.
#[derive(Deserialize)]
pub(super) struct ParticipantEntitiesInfo {
    gid: [u8; 16],
    nodes: Vec<NodeEntitiesInfo>,
}

/// `rmw_dds_common/msg/NodeEntitiesInfo`.
#[derive(Deserialize)]
struct NodeEntitiesInfo {
    namespace: String,
    name: String,
    _readers: Vec<[u8; 16]>,
    writers: Vec<[u8; 16]>,
}

/// The names of the nodes in the domain by their publishers, as far as they have been announced.
#[derive(Clone, Default)]
pub struct PublisherNames {
    state: Arc<Mutex<State>>,
}

#[derive(Default)]
struct State {
    /// Of each participant, its publishers with the names of their nodes.
    nodes: BTreeMap<[u8; 16], Vec<([u8; 16], String)>>,
    order: VecDeque<[u8; 16]>,
}

impl PublisherNames {
    /// The publisher in words: its node's name where that is known, and its GUID.
    pub fn describe(&self, publisher: PublisherId) -> String {
        let state = self.lock();
        let mut writers = state.nodes.values().flatten();
        match writers.find(|(writer, _)| PublisherId::new(*writer) == publisher) {
            Some((_, node)) => format!("{node} ({publisher})"),
            None => format!("an unknown node ({publisher})"),
        }
    }

    /// Follows the announcements for ever.
    pub(super) async fn follow(self, announcements: ros2_client::Subscription<ParticipantEntitiesInfo>) {
        let mut stream = std::pin::pin!(announcements.async_stream());
        while let Some(announced) = stream.next().await {
            if let Ok((info, _)) = announced {
                self.lock().take(info);
            }
        }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        // Nothing panics while it holds the lock.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl State {
    fn take(&mut self, info: ParticipantEntitiesInfo) {
        let of_node = |node: NodeEntitiesInfo| {
            let name = format!("{}/{}", node.namespace.trim_end_matches('/'), node.name);
            node.writers.into_iter().map(move |writer| (writer, name.clone()))
        };
        let writers = info.nodes.into_iter().flat_map(of_node).collect();
        if self.nodes.insert(info.gid, writers).is_none() {
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
            _readers: Vec::new(),
            writers: vec![[writer; 16]],
        };
        ParticipantEntitiesInfo { gid: [participant; 16], nodes: vec![node] }
    }

    #[test]
    fn publishers_have_the_names_of_their_nodes() {
        let names = PublisherNames::default();
        names.lock().take(announce(1, 7, "driver"));
        names.lock().take(announce(2, 8, "simulator"));
        let guid = "07.07.07.07.07.07.07.07.07.07.07.07.07.07.07.07";
        assert_eq!(names.describe(PublisherId::new([7; 16])), format!("/left/driver ({guid})"));
        assert!(names.describe(PublisherId::new([8; 16])).starts_with("/left/simulator"));
        assert!(names.describe(PublisherId::new([9; 16])).starts_with("an unknown node (09."));
    }
}
