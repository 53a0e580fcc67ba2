//! Readers.

use super::announcement::Announced;
use crate::wire::{InPlace, Reuse};
use rustdds::GUID;
use rustdds::dds::ReadError;
use rustdds::no_key::SimpleDataReaderCdr;
use rustdds::serialization::CdrDeserializeSeedDecoder;
use serde::de::DeserializeOwned;
use std::cell::Cell;
use std::marker::PhantomData;
use std::sync::atomic::{AtomicU64, Ordering};

/// A message as it came, with what DDS says of it.
pub(super) type Sample<M> = rustdds::no_key::DeserializedCacheChange<M>;

/// Reads messages of one type, for its node until it is dropped.
pub(super) struct Reader<M: 'static + DeserializeOwned> {
    inner: SimpleDataReaderCdr<M>,
    _announced: Option<Announced>,
    /// What came until then was for the reader before this one \[2⁻³² s since 1970\].
    since: u64,
    /// When the newest message came that was taken.
    newest: AtomicU64,
}

impl<M: 'static + DeserializeOwned> Reader<M> {
    pub fn new(inner: SimpleDataReaderCdr<M>, announced: Option<Announced>) -> Self {
        Self { inner, _announced: announced, since: 0, newest: AtomicU64::new(0) }
    }

    /// The same, which leaves alone what `old` has had: RustDDS gives a new reader what it still keeps of the topic.
    ///
    /// RustDDS stamps what comes to a topic with times that always rise, wherever the clock goes.
    pub fn after(self, old: &Self) -> Self {
        let newest = old.newest.load(Ordering::Relaxed);
        Self { since: newest, newest: AtomicU64::new(newest), ..self }
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
            let sample = self.inner.try_take_one().map_err(reason)?;
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
            match self.inner.try_take_one_with(decoder).map_err(reason)? {
                Some(sample) if !self.is_new(&sample) => place.set(sample.into_value()),
                sample => return Ok(sample),
            }
        }
    }

    fn is_new(&self, sample: &Sample<M>) -> bool {
        let ticks = sample.receive_instant.to_ticks();
        self.newest.fetch_max(ticks, Ordering::Relaxed);
        ticks > self.since
    }

    /// Waits for the next message that can be decoded.
    pub async fn next(&self) -> Sample<M> {
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

/// Why a message could not be decoded. Nothing is put together here: a thousand of them may come in a cycle.
fn reason(why: ReadError) -> String {
    match why {
        ReadError::Deserialization { reason } => reason,
        other => other.to_string(),
    }
}
