//! Remote participants that were lost and are back.
//!
//! A participant that was not heard for the time of its lease is lost: Cyclone gives 10 s, Fast DDS 20 s, RustDDS 50 s. A cable may have
//! been out, or its computer asleep. When it is heard again, RustDDS 0.15.1 knows it again, but matches none of its endpoints with
//! ours: what it announces of them has been read before and counts as a repetition (`discovery.rs`, "Participant rediscovery"). So
//! nothing would pass until one of the two is started again.
//!
//! An endpoint of ours that is new is matched with all that is known. So those of ours are made anew that have a counterpart there.

use super::endpoint::{Kind, Plan};
use super::error::RosError;
use super::participant::Participant;
use rustdds::dds::statusevents::{DomainParticipantStatusEvent as Event, LostReason};
use rustdds::{DomainParticipant, GUID};
use std::collections::{HashSet, VecDeque};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};

/// Lost participants that are remembered; the oldest goes first.
const PARTICIPANTS: usize = 256;

/// The beginning that the GUIDs of a participant and of all its endpoints share.
pub(super) type Prefix = [u8; 12];

/// RustDDS's own type of it has no public name.
pub(super) fn prefix(of: impl AsRef<[u8]>) -> Prefix {
    of.as_ref().first_chunk().copied().unwrap_or_default()
}

/// An endpoint that can be made anew.
pub(super) trait Remake: Send + Sync {
    /// What it is made from.
    fn plan(&self) -> Plan;

    /// The kind of the endpoints of others that it can be matched with.
    fn counterpart(&self) -> Kind;

    /// Makes it anew, by the same plan.
    fn remake(&self, participant: &Participant) -> Result<(), RosError>;
}

/// The endpoints of one participant that can be made anew, until they are dropped.
#[derive(Default)]
pub(super) struct Remakes(Mutex<Vec<Weak<dyn Remake>>>);

impl Remakes {
    /// One more endpoint.
    pub fn add<E: Remake + 'static>(&self, endpoint: &Arc<E>) {
        let mut endpoints = self.lock();
        endpoints.retain(|endpoint| endpoint.strong_count() > 0);
        let endpoint: Weak<E> = Arc::downgrade(endpoint);
        endpoints.push(endpoint);
    }

    /// Those that can be matched with one of these.
    fn matching(&self, remote: &HashSet<(String, Kind)>) -> Vec<Arc<dyn Remake>> {
        let endpoints = self.lock();
        let endpoints = endpoints.iter().filter_map(Weak::upgrade);
        endpoints
            .filter(|endpoint| remote.contains(&(endpoint.plan().topic.name, endpoint.counterpart())))
            .collect()
    }

    fn lock(&self) -> MutexGuard<'_, Vec<Weak<dyn Remake>>> {
        // Nothing panics while it holds the lock.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Which participants were lost without a word and have not come back.
#[derive(Clone, Default)]
pub(super) struct Lost(Arc<Mutex<VecDeque<Prefix>>>);

impl Lost {
    /// Takes note of an event; the participant that was lost and is back by it.
    pub fn take(&self, event: &Event) -> Option<Prefix> {
        let mut lost = self.lock();
        match event {
            Event::ParticipantLost { id, reason: LostReason::Timeout { .. } } => {
                lost.push_back(prefix(id));
                if lost.len() > PARTICIPANTS {
                    lost.pop_front();
                }
                None
            }
            Event::ParticipantDiscovered { dpd } => {
                let place = lost.iter().position(|lost| *lost == prefix(dpd.guid.prefix))?;
                lost.remove(place)
            }
            _ => None,
        }
    }

    /// Whether this one is lost.
    pub fn contains(&self, participant: Prefix) -> bool {
        self.lock().contains(&participant)
    }

    fn lock(&self) -> MutexGuard<'_, VecDeque<Prefix>> {
        // Nothing panics while it holds the lock.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// An endpoint of another participant.
pub(super) struct Found {
    pub endpoint: GUID,
    /// As DDS knows it.
    pub topic: String,
    pub kind: Kind,
}

/// Makes anew what can be matched with that participant, which was lost and is back.
pub(super) fn rejoin(participant: &Participant, remote: Prefix) {
    let there = endpoints(participant.dds(), remote);
    participant.matches().find_again(&there);
    let counterparts = there.into_iter().map(|found| (found.topic, found.kind)).collect();
    for endpoint in participant.remakes().matching(&counterparts) {
        let (remade, plan) = (endpoint.remake(participant), endpoint.plan());
        let Some(log) = plan.log else { continue };
        let topic = plan.topic.ros_name;
        match remade {
            Ok(()) => {
                log.info(&format!("{topic}: connected anew with a participant that was lost and is back"))
            }
            Err(why) => log.error(&format!("{topic}: a participant that was lost is back, but {why}")),
        }
    }
}

/// What is known of the endpoints of a participant.
fn endpoints(dds: &DomainParticipant, of: Prefix) -> Vec<Found> {
    let (readers, writers) = (dds.discovered_readers(), dds.discovered_writers());
    let readers = readers.iter().map(|reader| {
        let topic = reader.subscription_topic_data.topic_name().clone();
        Found { endpoint: reader.reader_proxy.remote_reader_guid, topic, kind: Kind::Reader }
    });
    let writers = writers.iter().map(|writer| {
        let topic = writer.publication_topic_data.topic_name().clone();
        Found { endpoint: writer.writer_proxy.remote_writer_guid, topic, kind: Kind::Writer }
    });
    readers.chain(writers).filter(|found| prefix(found.endpoint.prefix) == of).collect()
}
