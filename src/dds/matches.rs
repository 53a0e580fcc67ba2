//! Which remote endpoints are matched with ours, and which would be but for their QoS.
//!
//! RustDDS 0.15.1 says so by events alone, each once and to one listener: it answers no question of who is matched with whom, or how many
//! write to a topic. This goes when `DomainParticipant` or the endpoints answer them.

use super::first_found::FirstFound;
use super::first_sample_request::FirstSampleRequest;
use super::incompatible_qos::Mismatch;
use super::peer_recovery::{Lost, Peer, Prefix, Warn, prefix};
use crate::text::cut;
use futures::StreamExt;
use rustdds::dds::statusevents::{DomainParticipantStatusEvent as Event, LostReason};
use rustdds::{DomainParticipantStatusListener, GUID, StatusEvented};
use std::collections::{BTreeSet, HashMap, HashSet};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use tokio::sync::Notify;

/// Discovery has come to rest where nothing was found for this long.
const QUIET: Duration = Duration::from_millis(200);

/// A peer gets this long to announce its name before it is warned of without.
const INTRODUCTION: Duration = Duration::from_secs(1);

/// Who has what endpoints, in words.
pub(crate) trait Owners: Send + Sync {
    /// Whether the endpoint's owner is known.
    fn knows(&self, endpoint: GUID) -> bool;

    /// The endpoint in words, with its owner where that is known.
    fn describe(&self, endpoint: GUID) -> String;
}

/// What the participant's status events have reported so far.
#[derive(Clone)]
pub(crate) struct Matches {
    state: Arc<Mutex<State>>,
    changed: Arc<Notify>,
    owners: Arc<dyn Owners>,
}

#[derive(Default)]
struct State {
    /// Topic name of each of our endpoints, and where its owner is warned.
    topics: HashMap<GUID, (String, Warn)>,
    /// Our endpoint with a remote one.
    pairs: HashSet<(GUID, GUID)>,
    /// Our endpoint with a remote one whose QoS is incompatible, and the warning of it once there is one.
    incompatible: HashMap<(GUID, GUID), Option<String>>,
    /// Our readers that have a way to hear who publishes best effort only, and who does.
    adapting: HashMap<GUID, Option<GUID>>,
    /// DDS topic name of each writer in the domain, matched or not.
    writers: HashMap<GUID, String>,
    first_found: FirstFound,
    /// The same of each reader.
    readers: HashMap<GUID, String>,
    /// When a participant or a reader was last found.
    found: Option<Instant>,
}

impl Matches {
    /// Nothing yet; `owners` knows whose endpoints are whose.
    pub fn new(owners: Arc<dyn Owners>) -> Self {
        Self { state: Arc::default(), changed: Arc::default(), owners }
    }

    /// Names one of our endpoints, whose owner is warned of what QoS keeps from it.
    pub fn register(&self, ours: GUID, topic: &str, warn: Warn) {
        self.lock().topics.insert(ours, (topic.to_owned(), warn));
    }

    /// How many remote endpoints are matched with ours.
    pub fn count(&self, ours: GUID) -> usize {
        self.lock()
            .pairs
            .iter()
            .filter(|(local, other)| *local == ours && other.prefix != ours.prefix)
            .count()
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

    /// For how long the writer has been known; none where it may have been there before this process.
    pub fn known_for(&self, writer: GUID) -> Option<Duration> {
        self.lock().first_found.elapsed(writer)
    }

    /// How many writers of other participants than that of `ours` the DDS topic has.
    pub fn remote_writers(&self, dds_topic: &str, ours: GUID) -> usize {
        let state = self.lock();
        state.writers.iter().filter(|(guid, name)| guid.prefix != ours.prefix && *name == dds_topic).count()
    }

    /// Whether discovery has come to rest and each remote reader that it found on the topic is matched with our writer, or cannot be.
    pub fn has_all_readers(&self, ours: GUID, topic: &str) -> bool {
        let state = self.lock();
        let known = |reader: &GUID| {
            let pair = (ours, *reader);
            state.pairs.contains(&pair) || state.incompatible.contains_key(&pair)
        };
        let on_topic = |name: &String| name.strip_prefix("rt") == Some(topic);
        let mut readers =
            state.readers.iter().filter(|(guid, name)| guid.prefix != ours.prefix && on_topic(name));
        state.found.is_none_or(|found| found.elapsed() >= QUIET) && readers.all(|(reader, _)| known(reader))
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

    /// Follows the participant's events for ever, and asks writers that match for their first samples. There must be one follower only: events go to
    /// one reader.
    pub async fn follow(
        self,
        listener: DomainParticipantStatusListener,
        request: Option<Arc<FirstSampleRequest>>,
        mut lost: Lost,
    ) {
        let mut events = listener.as_async_status_stream();
        loop {
            let event = tokio::select! {
                Some(event) = events.next() => event,
                peer = lost.heard() => {
                    lost.is_back(peer);
                    continue;
                }
                else => return,
            };
            self.note_loss(&event, &mut lost);
            if let (Event::RemoteWriterMatched { local_reader, remote_writer }, Some(request)) =
                (&event, &request)
            {
                let (request, reader, writer) = (request.clone(), *local_reader, *remote_writer);
                tokio::spawn(async move { request.send(reader, writer).await });
            }
            self.take(event);
            self.changed.notify_waiters();
        }
    }

    /// Notes who is lost, and who is back.
    fn note_loss(&self, event: &Event, lost: &mut Lost) {
        match event {
            Event::ParticipantLost { id, reason: LostReason::Timeout { .. } } => {
                let peer = self.peer(prefix(id));
                peer.into_iter().for_each(|peer| lost.add(prefix(id), peer));
            }
            Event::ParticipantDiscovered { dpd } => {
                let peer = lost.remove(prefix(dpd.guid.prefix));
                peer.into_iter().for_each(|peer| lost.is_back(peer));
            }
            _ => {}
        }
    }

    /// What the participant is to our nodes; none where it is not connected with any.
    fn peer(&self, participant: Prefix) -> Option<Peer> {
        let state = self.lock();
        let (mut known, mut heard_on) = (None, BTreeSet::new());
        for (ours, remote) in state.pairs.iter().filter(|(_, remote)| prefix(remote.prefix) == participant) {
            // What is no node's own is not named.
            let Some((topic, warn)) = state.topics.get(ours) else { continue };
            if state.writers.contains_key(remote) {
                heard_on.insert(topic.clone());
            }
            known = Some((*remote, warn.clone()));
        }
        let (remote, warn) = known?;
        let name = self.owners.describe(remote);
        Some(Peer { name, heard_on: heard_on.into_iter().collect(), warn })
    }

    fn take(&self, event: Event) {
        let mut state = self.lock();
        match event {
            Event::RemoteReaderMatched { local_writer: ours, remote_reader: remote }
            | Event::RemoteWriterMatched { local_reader: ours, remote_writer: remote } => {
                state.pairs.insert((ours, remote));
            }
            Event::WriterDetected { writer } => {
                state.first_found.find(writer.guid);
                state.writers.insert(writer.guid, cut(&writer.topic_name).into_owned());
            }
            Event::ReaderDetected { reader } => {
                state.readers.insert(reader.guid, cut(&reader.topic_name).into_owned());
                state.found = Some(Instant::now());
            }
            Event::ParticipantDiscovered { .. } => state.found = Some(Instant::now()),
            Event::ReaderLost { guid, .. } | Event::WriterLost { guid, .. } => {
                state.forget(|remote| remote == guid);
            }
            Event::ParticipantLost { id, .. } => state.forget(|remote| remote.prefix == id),
            Event::RemoteReaderQosIncompatible {
                local_writer,
                remote_reader,
                requested_qos,
                offered_qos,
            } => {
                let mismatch = Mismatch::new(&requested_qos, &offered_qos);
                self.warn(&mut state, (local_writer, remote_reader), move |topic, peer| {
                    mismatch.warning_of_publisher(topic, peer)
                });
            }
            Event::RemoteWriterQosIncompatible {
                local_reader,
                remote_writer,
                requested_qos,
                offered_qos,
            } => {
                let mismatch = Mismatch::new(&requested_qos, &offered_qos);
                if mismatch.is_reliability()
                    && let Some(publisher) = state.adapting.get_mut(&local_reader)
                {
                    publisher.get_or_insert(remote_writer);
                    return;
                }
                self.warn(&mut state, (local_reader, remote_writer), move |topic, peer| {
                    mismatch.warning_of_subscriber(topic, peer)
                });
            }
            _ => {}
        }
    }

    /// Warns once of a pair between which nothing passes, as soon as the peer's name is known.
    fn warn(
        &self,
        state: &mut State,
        pair: (GUID, GUID),
        text: impl FnOnce(&str, &str) -> String + Send + 'static,
    ) {
        let (ours, remote) = pair;
        let Some((topic, warn)) = state.topics.get(&ours).cloned() else { return };
        if state.incompatible.contains_key(&pair) {
            return;
        }
        state.incompatible.insert(pair, None);
        let matches = self.clone();
        tokio::spawn(async move {
            let warning = text(&topic, &matches.introduced(remote).await);
            warn(&warning);
            if let Some(kept) = matches.lock().incompatible.get_mut(&pair) {
                *kept = Some(warning);
            }
        });
    }

    /// The peer in words, with its node's name where that comes in time.
    async fn introduced(&self, peer: GUID) -> String {
        let introduced = self.wait_until(|matches| matches.owners.knows(peer));
        let _ = tokio::time::timeout(INTRODUCTION, introduced).await;
        self.owners.describe(peer)
    }

    /// The warning of a publisher that our reader does not hear, if there is one.
    pub fn unheard(&self, ours: GUID) -> Option<String> {
        let state = self.lock();
        let mut of_ours = state.incompatible.iter().filter(|((reader, _), _)| *reader == ours);
        of_ours.find_map(|(_, warning)| warning.clone())
    }

    /// Our endpoint has gone.
    pub fn forget_ours(&self, ours: GUID) {
        let mut state = self.lock();
        state.topics.remove(&ours);
        state.adapting.remove(&ours);
        state.pairs.retain(|(own, _)| *own != ours);
        state.incompatible.retain(|(own, _), _| *own != ours);
        state.forget(|endpoint| endpoint == ours);
    }

    /// Our reader has a way to hear who publishes best effort only: no warning is due where that is all that is in the way.
    pub fn adapt(&self, ours: GUID) {
        self.lock().adapting.insert(ours, None);
    }

    /// Waits until somebody publishes best effort only what our reader asks for reliable; who it is.
    pub async fn best_effort_publisher(&self, ours: GUID) -> String {
        loop {
            let changed = self.changed.notified();
            let found = self.lock().adapting.get(&ours).copied().flatten();
            if let Some(publisher) = found {
                return self.introduced(publisher).await;
            }
            changed.await;
        }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        // Nothing panics while it holds the lock.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl State {
    /// Forgets the remote endpoints that have gone.
    fn forget(&mut self, gone: impl Fn(GUID) -> bool) {
        self.pairs.retain(|(_, remote)| !gone(*remote));
        self.incompatible.retain(|(_, remote), _| !gone(*remote));
        self.writers.retain(|writer, _| !gone(*writer));
        self.readers.retain(|reader, _| !gone(*reader));
    }
}
