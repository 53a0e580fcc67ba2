//! Readers, which their participant makes anew for a remote one that was lost and is back.

use super::announcement::Announced;
use super::endpoint::{Kind, Plan};
use super::error::RosError;
use super::participant::Participant;
use super::rejoin::Remake;
use super::slot::Slot;
use crate::wire::{InPlace, Reuse};
use rustdds::GUID;
use rustdds::no_key::SimpleDataReaderCdr;
use rustdds::serialization::CdrDeserializeSeedDecoder;
use serde::de::DeserializeOwned;
use std::cell::Cell;
use std::marker::PhantomData;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// A message as it came, with what DDS says of it.
pub(super) type Sample<M> = rustdds::no_key::DeserializedCacheChange<M>;

/// A reader as DDS has it, its node's until it is dropped.
pub(super) struct MadeReader<M: 'static + DeserializeOwned> {
    inner: SimpleDataReaderCdr<M>,
    plan: Plan,
    _announced: Option<Announced>,
    /// What came until then was for the reader before this one \[2⁻³² s since 1970\].
    since: u64,
    /// When the newest message came that was taken.
    newest: AtomicU64,
}

/// Reads messages of one type.
pub(super) struct Reader<M: 'static + DeserializeOwned> {
    slot: Arc<Slot<MadeReader<M>>>,
}

impl<M: 'static + DeserializeOwned> Reader<M> {
    pub fn new(made: MadeReader<M>) -> Self {
        Self { slot: Arc::new(Slot::new(made)) }
    }

    /// What can be made anew of it.
    pub fn slot(&self) -> &Arc<Slot<MadeReader<M>>> {
        &self.slot
    }

    /// The reader until it is made anew.
    pub fn now(&self) -> Arc<MadeReader<M>> {
        self.slot.get()
    }

    /// Waits for the next message that can be decoded.
    pub async fn next(&self) -> Sample<M> {
        loop {
            let replaced = self.slot.replaced();
            let reader = self.slot.get();
            tokio::select! {
                sample = reader.next() => return sample,
                () = replaced => {}
            }
        }
    }
}

impl<M: 'static + DeserializeOwned> MadeReader<M> {
    pub fn new(inner: SimpleDataReaderCdr<M>, plan: Plan, announced: Option<Announced>) -> Self {
        Self { inner, plan, _announced: announced, since: 0, newest: AtomicU64::new(0) }
    }

    /// Its identity in DDS.
    pub fn guid(&self) -> GUID {
        self.inner.guid()
    }

    /// The next message, if one has come; or why it could not be decoded.
    ///
    /// RustDDS's notifications are left where they are: they are for those who wait by a poll of their own. To drain them is an
    /// allocation and a system call each time, and once they fill their queue RustDDS adds none.
    pub fn take(&self) -> Result<Option<Sample<M>>, String> {
        loop {
            let sample = self.inner.try_take_one().map_err(|why| why.to_string())?;
            if sample.as_ref().is_none_or(|sample| self.is_new(sample)) {
                return Ok(sample);
            }
        }
    }

    /// The same, decoded over the message in `place`.
    pub fn take_over(&self, place: &Cell<M>) -> Result<Option<Sample<M>>, String>
    where
        M: InPlace,
    {
        loop {
            // No topic of ROS 2 has a key.
            let decoder = CdrDeserializeSeedDecoder::new(Reuse(place), PhantomData::<()>);
            match self.inner.try_take_one_with(decoder).map_err(|why| why.to_string())? {
                Some(sample) if !self.is_new(&sample) => place.set(sample.into_value()),
                sample => return Ok(sample),
            }
        }
    }

    /// Whether a message is none that the reader before this one had: RustDDS gives a new reader what it still keeps of the topic.
    ///
    /// RustDDS stamps what comes to a topic with times that always rise, wherever the clock goes.
    fn is_new(&self, sample: &Sample<M>) -> bool {
        let ticks = sample.receive_instant.to_ticks();
        self.newest.fetch_max(ticks, Ordering::Relaxed);
        ticks > self.since
    }

    async fn next(&self) -> Sample<M> {
        use futures::StreamExt;
        let mut samples = std::pin::pin!(self.inner.as_async_stream());
        loop {
            match samples.next().await {
                Some(Ok(sample)) if self.is_new(&sample) => return sample,
                Some(_) => {}
                // It does not end; if it did, nothing would come any more.
                None => std::future::pending().await,
            }
        }
    }
}

impl<M: 'static + DeserializeOwned> Slot<MadeReader<M>> {
    /// Reads by that plan from now on.
    pub fn exchange(&self, participant: &Participant, plan: Plan) -> Result<(), RosError> {
        let (old, new) = (self.get(), participant.make_reader(plan)?);
        participant.matches().replace(old.guid(), new.guid());
        let newest = old.newest.load(Ordering::Relaxed);
        self.put(MadeReader { since: newest, newest: AtomicU64::new(newest), ..new });
        Ok(())
    }
}

impl<M: Send + Sync + 'static + DeserializeOwned> Remake for Slot<MadeReader<M>> {
    fn plan(&self) -> Plan {
        self.get().plan.clone()
    }

    fn counterpart(&self) -> Kind {
        Kind::Writer
    }

    fn remake(&self, participant: &Participant) -> Result<(), RosError> {
        self.exchange(participant, self.plan())
    }
}
