//! Publishers and subscriptions.

use super::error::RosError;
use super::graph::EndpointId;
use super::matches::Matches;
use super::padded::Padded;
use super::participant::{Reader, Sample, Writer};
use crate::text::cut;
use crate::wire::InPlace;
use crate::wire::messages::Message;
use serde::{Serialize, Serializer};
use std::cell::Cell;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use tokio::sync::Notify;

/// A message that its publisher may keep.
pub(super) struct Shared<M>(Arc<M>);

impl<M: Serialize> Serialize for Shared<M> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.0.serialize(serializer)
    }
}

/// Publishes messages of one type; never blocks.
pub struct Publisher<M: Message> {
    inner: Writer<Padded<Shared<M>>>,
    topic: String,
    dropped: AtomicU64,
    matches: Matches,
}

impl<M: Message> Publisher<M> {
    pub(super) fn new(inner: Writer<Padded<Shared<M>>>, topic: String, matches: Matches) -> Self {
        Self { inner, topic, dropped: AtomicU64::new(0), matches }
    }

    /// Queues a message for all readers. One for which a frozen reader left no room is dropped and counted. Who publishes an [`Arc`] of
    /// it is its only holder again afterwards, and can write the next one into it.
    pub fn publish(&self, message: impl Into<Arc<M>>) {
        if !self.inner.write(Padded(Shared(message.into()))) {
            self.dropped.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Messages dropped so far.
    pub fn dropped(&self) -> u64 {
        self.dropped.load(Ordering::Relaxed)
    }

    /// The topic's full name.
    pub fn topic(&self) -> &str {
        &self.topic
    }

    /// How many others publish on the topic, as far as discovery knows. One that was killed counts until its lease ends.
    pub fn other_publishers(&self) -> usize {
        self.matches.other_writers(&self.topic, self.inner.guid())
    }

    /// How many subscribe to what this publishes.
    pub fn readers(&self) -> usize {
        self.matches.count(self.inner.guid())
    }

    /// Waits until somebody subscribes, and then until all do of whom discovery knows, or can be said not to: a subscription that
    /// is discovered a moment later than the first one would miss what is published between.
    ///
    /// # Errors
    /// [`RosError::Write`] where nobody subscribes within `patience`.
    pub async fn wait_for_readers(&self, patience: Duration) -> Result<(), RosError> {
        let guid = self.inner.guid();
        let somebody = self.matches.wait_until(|matches| matches.count(guid) > 0);
        tokio::time::timeout(patience, somebody).await.map_err(|_| RosError::Write {
            topic: self.topic.clone(),
            why: format!("nobody subscribed within {} s", patience.as_secs_f64()),
        })?;
        let all = self.matches.wait_until(|matches| matches.has_all_readers(guid, &self.topic));
        // Those who cannot be matched in time would keep the others waiting.
        let _ = tokio::time::timeout(STRAGGLERS, all).await;
        Ok(())
    }
}

/// How long the first subscription waits for others.
const STRAGGLERS: Duration = Duration::from_secs(2);

/// What a subscription held.
pub struct Newest<M> {
    /// The newest message, if any came.
    pub message: Option<M>,
    /// How many came that could be decoded.
    pub count: u64,
    /// Why messages could not be decoded.
    pub malformed: Vec<String>,
}

/// The reader of a subscription, which another one may replace.
pub(super) struct Slot<M: Message> {
    reader: Mutex<Arc<Reader<M>>>,
    replaced: Notify,
}

impl<M: Message> Slot<M> {
    /// Its identity in DDS.
    pub fn guid(&self) -> rustdds::GUID {
        self.get().guid()
    }

    /// Reads by this one from now on.
    pub fn put(&self, reader: Reader<M>) {
        let old = std::mem::replace(&mut *self.lock(), Arc::new(reader));
        self.replaced.notify_waiters();
        // Not while the lock is held: that is the cycle's too.
        drop(old);
    }

    fn get(&self) -> Arc<Reader<M>> {
        self.lock().clone()
    }

    fn lock(&self) -> MutexGuard<'_, Arc<Reader<M>>> {
        // Nothing panics while it holds the lock.
        self.reader.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Receives messages of one type.
pub struct Subscription<M: Message> {
    slot: Arc<Slot<M>>,
    topic: String,
    matches: Matches,
}

/// Most messages taken at once, so that a flood cannot hold the caller for ever.
const DRAIN: usize = 1000;

impl<M: Message> Subscription<M> {
    pub(super) fn new(reader: Reader<M>, topic: String, matches: Matches) -> Self {
        let slot = Slot { reader: Mutex::new(Arc::new(reader)), replaced: Notify::new() };
        Self { slot: Arc::new(slot), topic, matches }
    }

    pub(super) fn slot(&self) -> Arc<Slot<M>> {
        self.slot.clone()
    }

    /// Why a publisher of the topic is not heard, if one is not.
    pub fn unheard(&self) -> Option<String> {
        self.matches.unheard(self.slot.guid())
    }

    /// The topic's full name.
    pub fn topic(&self) -> &str {
        &self.topic
    }

    /// How many publish on the topic, as far as discovery knows. One that was killed counts until its lease ends.
    pub fn publishers(&self) -> usize {
        self.matches.other_writers(&self.topic, self.slot.guid())
    }

    /// Takes all that came, keeps the newest. Never blocks.
    pub fn newest(&self) -> Newest<M> {
        let (mut message, mut count) = (None, 0);
        let malformed = self.each(|next| {
            message = Some(next);
            count += 1;
        });
        Newest { message, count, malformed }
    }

    /// Takes all that came and gives each to `take`, in their order; returns why others could not be decoded. Never blocks.
    pub fn each(&self, mut take: impl FnMut(M)) -> Vec<String> {
        self.drain(Reader::take, |sample| take(sample.into_value()))
    }

    /// As [`each`](Self::each), with the publisher that each message is from. Each is decoded over the one before, which is in `place`:
    /// messages like those before allocate nothing.
    pub fn each_over(&self, place: &mut M, mut take: impl FnMut(&M, EndpointId)) -> Vec<String>
    where
        M: InPlace,
    {
        let place = Cell::from_mut(place);
        self.drain(
            |reader| reader.take_over(place),
            |sample| {
                let publisher = EndpointId::new(sample.writer_guid.to_bytes());
                let message = sample.into_value();
                take(&message, publisher);
                place.set(message);
            },
        )
    }

    fn drain(
        &self,
        next: impl Fn(&Reader<M>) -> Result<Option<Sample<M>>, String>,
        mut take: impl FnMut(Sample<M>),
    ) -> Vec<String> {
        let (mut malformed, reader) = (Vec::new(), self.slot.get());
        for _ in 0..DRAIN {
            match next(&reader) {
                Ok(Some(sample)) => take(sample),
                Ok(None) => break,
                Err(why) => malformed.push(cut(&why).into_owned()),
            }
        }
        malformed
    }

    /// Waits for the next message; what cannot be decoded is passed over.
    pub async fn next(&self) -> M {
        loop {
            let replaced = self.slot.replaced.notified();
            let reader = self.slot.get();
            tokio::select! {
                sample = reader.next() => return sample.into_value(),
                () = replaced => {}
            }
        }
    }
}
