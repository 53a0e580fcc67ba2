//! Writers, which their participant makes anew for a remote one that was lost and is back.

use super::announcement::Announced;
use super::endpoint::{Kind, Plan};
use super::error::RosError;
use super::participant::Participant;
use super::rejoin::Remake;
use super::slot::Slot;
use rustdds::no_key::DataWriterCdr;
use rustdds::policy::{Durability, History};
use rustdds::{GUID, QosPolicies, RTPSEntity, SampleIdentity, Timestamp, WriteOptions};
use serde::Serialize;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// A writer as DDS has it, its node's until it is dropped.
pub(super) struct MadeWriter<M: Serialize> {
    inner: DataWriterCdr<M>,
    plan: Plan,
    _announced: Option<Announced>,
    /// The last message, where those who come later get it too.
    latched: Option<Mutex<Option<M>>>,
}

/// Writes messages of one type.
pub(super) struct Writer<M: Serialize> {
    slot: Arc<Slot<MadeWriter<M>>>,
}

impl<M: Clone + Serialize + Send + Sync + 'static> Writer<M> {
    pub fn new(made: MadeWriter<M>) -> Self {
        Self { slot: Arc::new(Slot::new(made)) }
    }

    /// What can be made anew of it.
    pub fn slot(&self) -> &Arc<Slot<MadeWriter<M>>> {
        &self.slot
    }

    /// Its identity in DDS, until it is made anew.
    pub fn guid(&self) -> GUID {
        self.slot.get().inner.guid()
    }

    /// Queues a message; whether there was room.
    pub fn write(&self, message: M) -> bool {
        self.slot.get().write(message)
    }

    /// Queues a message, and waits for room; the sample's identity, or why there is none.
    pub async fn write_with(&self, message: M, options: WriteOptions) -> Result<SampleIdentity, String> {
        let writer = self.slot.get();
        writer.inner.async_write_with_options(message, options).await.map_err(|why| why.to_string())
    }
}

impl<M: Serialize> MadeWriter<M> {
    pub fn new(inner: DataWriterCdr<M>, plan: Plan, announced: Option<Announced>) -> Self {
        let latched = is_latched(&plan.topic.qos).then(Mutex::default);
        Self { inner, plan, _announced: announced, latched }
    }
}

impl<M: Clone + Serialize> MadeWriter<M> {
    fn write(&self, message: M) -> bool {
        if let Some(latched) = &self.latched {
            *lock(latched) = Some(message.clone());
        }
        self.inner.write(message, Some(Timestamp::now())).is_ok()
    }
}

/// Whether those who come later get the last message too.
fn is_latched(qos: &QosPolicies) -> bool {
    qos.durability() == Some(Durability::TransientLocal)
        && qos.history() == Some(History::KeepLast { depth: 1 })
}

fn lock<M>(latched: &Mutex<Option<M>>) -> MutexGuard<'_, Option<M>> {
    // Nothing panics while it holds the lock.
    latched.lock().unwrap_or_else(PoisonError::into_inner)
}

impl<M: Clone + Serialize + Send + Sync + 'static> Remake for Slot<MadeWriter<M>> {
    fn plan(&self) -> Plan {
        self.get().plan.clone()
    }

    fn counterpart(&self) -> Kind {
        Kind::Reader
    }

    fn remake(&self, participant: &Participant) -> Result<(), RosError> {
        let old = self.get();
        let new = participant.make_writer(old.plan.clone())?;
        if let Some(message) = old.latched.as_ref().and_then(|latched| lock(latched).clone()) {
            new.write(message);
        }
        participant.matches().replace(old.inner.guid(), new.inner.guid());
        self.put(new);
        Ok(())
    }
}
