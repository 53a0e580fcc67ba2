//! Tracks which remote endpoints are matched with ours, and which cannot be matched because of their QoS.
//!
//! RustDDS 0.15.1 reports matches only by events, each event once and to one listener. It has no queries for matched endpoints or
//! for the writers of a topic. Delete this module when `DomainParticipant` or the endpoints have such queries.

use super::first_found::FirstFound;
use super::peer_recovery::Warn;
use rustdds::GUID;
use std::collections::{HashMap, HashSet};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use tokio::sync::Notify;

/// Discovery counts as complete when no further participant or reader has been discovered for this time.
const QUIET: Duration = Duration::from_millis(200);

/// How long to wait for a peer's name before a warning is logged without the name.
const INTRODUCTION: Duration = Duration::from_secs(1);

/// Finds the owner of an endpoint, that is, the node that created it.
pub(crate) trait Owners: Send + Sync {
    /// Returns whether the endpoint's owner is known.
    fn knows(&self, endpoint: GUID) -> bool;

    /// Returns a description of the endpoint, with its owner if known.
    fn describe(&self, endpoint: GUID) -> String;
}

/// The endpoints that our participant knows from the events of RustDDS, and which of them are matched.
#[derive(Clone)]
pub(crate) struct Matches {
    state: Arc<Mutex<State>>,
    pub(super) changed: Arc<Notify>,
    pub(super) owners: Arc<dyn Owners>,
}

/// A pair of one of our endpoints and a remote endpoint.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct Pair {
    pub ours: GUID,
    pub remote: GUID,
}

/// One of our endpoints.
#[derive(Clone)]
pub(super) struct OwnEndpoint {
    pub topic: String,
    /// Writes a warning to the log of the endpoint's owner.
    pub warn: Warn,
}

/// The content of [`Matches`].
#[derive(Default)]
pub(super) struct State {
    pub own: HashMap<GUID, OwnEndpoint>,
    /// The matched pairs.
    pub pairs: HashSet<Pair>,
    /// The pairs with incompatible QoS. The value is the warning about the pair; `None` until the warning has been logged.
    pub incompatible: HashMap<Pair, Option<String>>,
    /// Our readers that can switch to best effort. The value is a publisher that requires this switch; `None` until there is one.
    pub adapting: HashMap<GUID, Option<GUID>>,
    /// The DDS topic name of each writer in the domain, matched or not.
    pub writers: HashMap<GUID, String>,
    pub first_found: FirstFound,
    /// The DDS topic name of each reader.
    pub readers: HashMap<GUID, String>,
    /// The time of the latest discovery of a participant or a reader; `None` before the first discovery.
    pub found: Option<Instant>,
}

impl Matches {
    /// Creates an empty state. `owners` finds the owners of endpoints, for warnings.
    pub fn new(owners: Arc<dyn Owners>) -> Self {
        Self { state: Arc::default(), changed: Arc::default(), owners }
    }

    /// Registers `ours`, one of our endpoints. `warn` logs warnings about incompatible QoS of this endpoint.
    pub fn register(&self, ours: GUID, topic: &str, warn: Warn) {
        self.lock().own.insert(ours, OwnEndpoint { topic: topic.to_owned(), warn });
    }

    /// Returns the number of remote endpoints that are matched with `ours`.
    pub fn count(&self, ours: GUID) -> usize {
        self.lock().pairs.iter().filter(|pair| pair.ours == ours && pair.remote.prefix != ours.prefix).count()
    }

    /// Returns whether the endpoint `remote` is matched with any of our endpoints.
    pub fn has_remote(&self, remote: GUID) -> bool {
        self.lock().pairs.iter().any(|pair| pair.remote == remote)
    }

    /// Returns whether no endpoint of our participant is matched with an endpoint of another participant. `ours` is any GUID of our
    /// participant.
    pub fn is_alone(&self, ours: GUID) -> bool {
        self.lock().pairs.iter().all(|pair| pair.remote.prefix == ours.prefix)
    }

    /// Returns the number of writers of the topic in the whole domain, except `ours`.
    pub fn other_writers(&self, topic: &str, ours: GUID) -> usize {
        let state = self.lock();
        let on_topic = |name: &String| name.strip_prefix("rt") == Some(topic);
        state.writers.iter().filter(|(guid, name)| **guid != ours && on_topic(name)).count()
    }

    /// Returns the time since `writer` was first discovered; `None` if the writer may be older than this process.
    pub fn known_for(&self, writer: GUID) -> Option<Duration> {
        self.lock().first_found.elapsed(writer)
    }

    /// Returns the number of writers of the DDS topic in other participants. `ours` is any GUID of our participant.
    pub fn remote_writers(&self, dds_topic: &str, ours: GUID) -> usize {
        let state = self.lock();
        state.writers.iter().filter(|(guid, name)| guid.prefix != ours.prefix && *name == dds_topic).count()
    }

    /// Returns whether our writer `ours` has all its readers: discovery is complete, and each remote reader of the topic is matched
    /// with the writer or cannot be matched.
    pub fn has_all_readers(&self, ours: GUID, topic: &str) -> bool {
        let state = self.lock();
        let known = |reader: &GUID| {
            let pair = Pair { ours, remote: *reader };
            state.pairs.contains(&pair) || state.incompatible.contains_key(&pair)
        };
        let on_topic = |name: &String| name.strip_prefix("rt") == Some(topic);
        let mut readers =
            state.readers.iter().filter(|(guid, name)| guid.prefix != ours.prefix && on_topic(name));
        state.found.is_none_or(|found| found.elapsed() >= QUIET) && readers.all(|(reader, _)| known(reader))
    }

    /// Waits until `condition` holds. Checks the condition at every change, and every 50 ms because some changes cause no event.
    pub async fn wait_until(&self, condition: impl Fn(&Self) -> bool) {
        while !condition(self) {
            self.change().await;
        }
    }

    /// Waits until a match or an endpoint changes, at most 50 ms.
    pub async fn change(&self) {
        let change = self.changed.notified();
        let _ = tokio::time::timeout(std::time::Duration::from_millis(50), change).await;
    }

    /// Returns the warning about a publisher from which our reader cannot receive; `None` if there is no such publisher.
    pub fn unheard(&self, ours: GUID) -> Option<String> {
        let state = self.lock();
        let mut of_ours = state.incompatible.iter().filter(|(pair, _)| pair.ours == ours);
        of_ours.find_map(|(_, warning)| warning.clone())
    }

    /// Forgets `ours`, an endpoint that has been dropped.
    pub fn forget_ours(&self, ours: GUID) {
        let mut state = self.lock();
        state.own.remove(&ours);
        state.adapting.remove(&ours);
        state.pairs.retain(|pair| pair.ours != ours);
        state.incompatible.retain(|pair, _| pair.ours != ours);
        state.forget(|endpoint| endpoint == ours);
    }

    /// Registers our reader as able to switch to best effort, so that no warning is logged for best-effort publishers.
    pub fn adapt(&self, ours: GUID) {
        self.lock().adapting.insert(ours, None);
    }

    /// Waits for a best-effort publisher on the topic of our reliable reader, and returns a description of the publisher.
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

    /// Returns the description of a peer, with the name of the peer's node if the name arrives in time.
    pub async fn introduced(&self, peer: GUID) -> String {
        let introduced = self.wait_until(|matches| matches.owners.knows(peer));
        let _ = tokio::time::timeout(INTRODUCTION, introduced).await;
        self.owners.describe(peer)
    }

    pub(super) fn lock(&self) -> MutexGuard<'_, State> {
        // No code panics while it holds the lock.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl State {
    /// Forgets the endpoints for which `gone` returns true.
    pub fn forget(&mut self, gone: impl Fn(GUID) -> bool) {
        self.pairs.retain(|pair| !gone(pair.remote));
        self.incompatible.retain(|pair, _| !gone(pair.remote));
        self.writers.retain(|writer, _| !gone(*writer));
        self.readers.retain(|reader, _| !gone(*reader));
    }
}
