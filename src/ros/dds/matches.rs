//! Which remote endpoints are matched with ours, and which would be but for their QoS.
//!
//! RustDDS 0.15.1 says so by events alone, each once and to one listener: it answers no question of who is matched with whom, or how many
//! write to a topic. This goes when `DomainParticipant` or the endpoints answer them.

use super::first_found::FirstFound;
use super::peer_recovery::Warn;
use rustdds::GUID;
use std::collections::{HashMap, HashSet};
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
    pub(super) changed: Arc<Notify>,
    pub(super) owners: Arc<dyn Owners>,
}

/// One of our endpoints with a remote one.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct Pair {
    pub ours: GUID,
    pub remote: GUID,
}

/// What is known of one of our endpoints.
#[derive(Clone)]
pub(super) struct OwnEndpoint {
    pub topic: String,
    /// Where its owner is warned.
    pub warn: Warn,
}

/// What they add up to.
#[derive(Default)]
pub(super) struct State {
    pub own: HashMap<GUID, OwnEndpoint>,
    /// Those that are matched.
    pub pairs: HashSet<Pair>,
    /// Those whose QoS is incompatible, and the warning of it once there is one.
    pub incompatible: HashMap<Pair, Option<String>>,
    /// Our readers that have a way to hear who publishes best effort only, and who does.
    pub adapting: HashMap<GUID, Option<GUID>>,
    /// DDS topic name of each writer in the domain, matched or not.
    pub writers: HashMap<GUID, String>,
    pub first_found: FirstFound,
    /// The same of each reader.
    pub readers: HashMap<GUID, String>,
    /// When a participant or a reader was last found.
    pub found: Option<Instant>,
}

impl Matches {
    /// Nothing yet; `owners` knows whose endpoints are whose.
    pub fn new(owners: Arc<dyn Owners>) -> Self {
        Self { state: Arc::default(), changed: Arc::default(), owners }
    }

    /// Names one of our endpoints, whose owner is warned of what QoS keeps from it.
    pub fn register(&self, ours: GUID, topic: &str, warn: Warn) {
        self.lock().own.insert(ours, OwnEndpoint { topic: topic.to_owned(), warn });
    }

    /// How many remote endpoints are matched with ours.
    pub fn count(&self, ours: GUID) -> usize {
        self.lock().pairs.iter().filter(|pair| pair.ours == ours && pair.remote.prefix != ours.prefix).count()
    }

    /// Whether the remote endpoint is matched with any of ours.
    pub fn has_remote(&self, remote: GUID) -> bool {
        self.lock().pairs.iter().any(|pair| pair.remote == remote)
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
            let pair = Pair { ours, remote: *reader };
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

    /// The warning of a publisher that our reader does not hear, if there is one.
    pub fn unheard(&self, ours: GUID) -> Option<String> {
        let state = self.lock();
        let mut of_ours = state.incompatible.iter().filter(|(pair, _)| pair.ours == ours);
        of_ours.find_map(|(_, warning)| warning.clone())
    }

    /// Our endpoint has gone.
    pub fn forget_ours(&self, ours: GUID) {
        let mut state = self.lock();
        state.own.remove(&ours);
        state.adapting.remove(&ours);
        state.pairs.retain(|pair| pair.ours != ours);
        state.incompatible.retain(|pair, _| pair.ours != ours);
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

    /// The peer in words, with its node's name where that comes in time.
    pub async fn introduced(&self, peer: GUID) -> String {
        let introduced = self.wait_until(|matches| matches.owners.knows(peer));
        let _ = tokio::time::timeout(INTRODUCTION, introduced).await;
        self.owners.describe(peer)
    }

    pub(super) fn lock(&self) -> MutexGuard<'_, State> {
        // Nothing panics while it holds the lock.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl State {
    /// Forgets the remote endpoints that have gone.
    pub fn forget(&mut self, gone: impl Fn(GUID) -> bool) {
        self.pairs.retain(|pair| !gone(pair.remote));
        self.incompatible.retain(|pair, _| !gone(pair.remote));
        self.writers.retain(|writer, _| !gone(*writer));
        self.readers.retain(|reader, _| !gone(*reader));
    }
}
