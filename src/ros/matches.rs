//! Which remote endpoints are matched with ours, and which would be but for their QoS.

use super::log::Logger;
use crate::text::cut;
use futures::StreamExt;
use rustdds::dds::statusevents::DomainParticipantStatusEvent as Event;
use rustdds::{DomainParticipant, GUID, StatusEvented};
use std::collections::{HashMap, HashSet};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tokio::sync::Notify;

/// What the participant's status events have told so far.
#[derive(Clone, Default)]
pub(super) struct Matches {
    state: Arc<Mutex<State>>,
    changed: Arc<Notify>,
}

#[derive(Default)]
struct State {
    /// Topic name of each of our endpoints.
    topics: HashMap<GUID, String>,
    /// Our endpoint with a remote one.
    pairs: HashSet<(GUID, GUID)>,
    /// DDS topic name of each writer in the domain, matched or not.
    writers: HashMap<GUID, String>,
}

impl Matches {
    /// Names one of our endpoints for the log.
    pub fn register(&self, ours: GUID, topic: &str) {
        self.lock().topics.insert(ours, topic.to_owned());
    }

    /// How many remote endpoints are matched with ours.
    pub fn count(&self, ours: GUID) -> usize {
        self.lock().pairs.iter().filter(|(local, _)| *local == ours).count()
    }

    /// Whether the remote endpoint is matched with any of ours.
    pub fn has_remote(&self, remote: GUID) -> bool {
        self.lock().pairs.iter().any(|(_, other)| *other == remote)
    }

    /// How many writers other than `ours` the topic has in the whole domain.
    pub fn other_writers(&self, topic: &str, ours: GUID) -> usize {
        let state = self.lock();
        let on_topic = |name: &String| name.strip_prefix("rt") == Some(topic);
        state.writers.iter().filter(|(guid, name)| **guid != ours && on_topic(name)).count()
    }

    /// How many writers of other participants than that of `ours` the DDS topic has.
    pub fn remote_writers(&self, dds_topic: &str, ours: GUID) -> usize {
        let state = self.lock();
        state.writers.iter().filter(|(guid, name)| guid.prefix != ours.prefix && *name == dds_topic).count()
    }

    /// Waits until `condition` holds; it is tried at every change and, for what has no event, each 50 ms.
    pub async fn wait_until(&self, condition: impl Fn(&Self) -> bool) {
        while !condition(self) {
            self.change().await;
        }
    }

    /// Waits for a change, 50 ms at most.
    pub async fn change(&self) {
        let change = self.changed.notified();
        let _ = tokio::time::timeout(std::time::Duration::from_millis(50), change).await;
    }

    /// Follows the participant's events for ever. There must be one follower only: events go to one reader.
    pub async fn follow(self, participant: DomainParticipant, log: Logger) {
        let listener = participant.status_listener();
        // The listener outlives its participant's clones only if they are gone.
        drop(participant);
        let mut events = listener.as_async_status_stream();
        while let Some(event) = events.next().await {
            self.take(event, &log);
            self.changed.notify_waiters();
        }
    }

    fn take(&self, event: Event, log: &Logger) {
        match event {
            Event::RemoteReaderMatched { local_writer, remote_reader } => {
                self.lock().pairs.insert((local_writer, remote_reader));
            }
            Event::RemoteWriterMatched { local_reader, remote_writer } => {
                self.lock().pairs.insert((local_reader, remote_writer));
            }
            Event::WriterDetected { writer } => {
                self.lock().writers.insert(writer.guid, cut(&writer.topic_name).into_owned());
            }
            Event::ReaderLost { guid, .. } | Event::WriterLost { guid, .. } => {
                let mut state = self.lock();
                state.pairs.retain(|(_, remote)| *remote != guid);
                state.writers.remove(&guid);
            }
            Event::ParticipantLost { id, .. } => {
                let mut state = self.lock();
                state.pairs.retain(|(_, remote)| remote.prefix != id);
                state.writers.retain(|writer, _| writer.prefix != id);
            }
            Event::RemoteReaderQosIncompatible { local_writer: local, .. }
            | Event::RemoteWriterQosIncompatible { local_reader: local, .. } => {
                if let Some(topic) = self.lock().topics.get(&local) {
                    log.warn(&format!(
                        "another node's QoS on {topic} is incompatible with ours: no messages will pass between them"
                    ));
                }
            }
            _ => {}
        }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        // Nothing panics while it holds the lock.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
