//! Publishers and subscriptions.

use super::endpoint::Plan;
use super::error::RosError;
use super::graph::EndpointId;
use super::origin::Origin;
use super::participant::Participant;
use super::reader::{Reader, Sample};
use super::writer::Writer;
use crate::dds::matches::Matches;
use crate::dds::payload_padding::Padded;
use crate::text::cut;
use crate::wire::InPlace;
use crate::wire::messages::Message;
use serde::{Serialize, Serializer};
use std::cell::Cell;
use std::marker::PhantomData;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Weak};
use std::time::Duration;
use tokio::sync::watch;

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
    /// it is its only holder again afterwards, unless later readers get it too, and can write the next one into it.
    pub fn publish(&self, message: impl Into<Arc<M>>) {
        self.count(self.inner.write(Padded(Shared(message.into()))));
    }

    /// As [`publish`](Self::publish), for what is soon too old: a message is dropped and counted too while three of before it still wait for
    /// DDS's thread to send them.
    pub fn publish_in_time(&self, message: impl Into<Arc<M>>) {
        self.count(self.inner.write_in_time(Padded(Shared(message.into()))));
    }

    fn count(&self, queued: bool) {
        self.dropped.fetch_add(u64::from(!queued), Ordering::Relaxed);
    }

    /// Queues what `make` makes, where anybody subscribes: else nothing is made, and RustDDS's thread not woken.
    pub fn publish_if_heard(&self, make: impl FnOnce() -> M) {
        if self.readers() > 0 {
            self.publish(make());
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

    /// Its identity in the domain.
    pub fn id(&self) -> EndpointId {
        self.inner.guid().into()
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

/// A topic on which a node publishes, to which it can subscribe when it needs to.
pub struct OwnTopic<M: Message> {
    participant: Weak<Participant>,
    plan: Plan,
    topic: String,
    message: PhantomData<fn() -> M>,
}

impl<M: Message> OwnTopic<M> {
    pub(super) fn new(participant: Weak<Participant>, plan: Plan, topic: String) -> Self {
        Self { participant, plan, topic, message: PhantomData }
    }

    /// How many others than the publisher `own` publish on the topic, as far as discovery knows; none where the node ends.
    pub fn other_publishers(&self, own: EndpointId) -> usize {
        let own = own.guid();
        self.participant.upgrade().map_or(0, |it| it.matches().other_writers(&self.topic, own))
    }

    /// Subscribes to it.
    ///
    /// # Errors
    /// [`RosError`].
    pub fn subscribe(&self) -> Result<Subscription<M>, RosError> {
        let ended = || RosError::create("a subscription")(&"the node has ended");
        let participant = self.participant.upgrade().ok_or_else(ended)?;
        let reader = participant.reader(self.plan.clone())?;
        let (_, reader) = watch::channel(Arc::new(reader));
        Ok(Subscription::new(reader, self.topic.clone(), participant.matches().clone()))
    }
}

/// What a subscription held.
pub struct Newest<M> {
    /// The newest message, if any came.
    pub message: Option<M>,
    /// How many came that could be decoded.
    pub count: u64,
    /// Why messages could not be decoded.
    pub malformed: Vec<String>,
}

/// Receives messages of one type.
pub struct Subscription<M: Message> {
    /// Another may take the reader's place.
    reader: watch::Receiver<Arc<Reader<M>>>,
    topic: String,
    matches: Matches,
}

/// Most messages taken at once, so that a flood cannot hold the caller for ever.
const DRAIN: usize = 1000;

impl<M: Message> Subscription<M> {
    /// By the reader that is there; whoever has the other end replaces it.
    pub(super) fn new(reader: watch::Receiver<Arc<Reader<M>>>, topic: String, matches: Matches) -> Self {
        Self { reader, topic, matches }
    }

    fn now(&self) -> Arc<Reader<M>> {
        self.reader.borrow().clone()
    }

    /// Why a publisher of the topic is not heard, if one is not.
    pub fn unheard(&self) -> Option<String> {
        self.matches.unheard(self.now().guid())
    }

    /// The topic's full name.
    pub fn topic(&self) -> &str {
        &self.topic
    }

    /// How many publish on the topic, as far as discovery knows. One that was killed counts until its lease ends.
    pub fn publishers(&self) -> usize {
        self.matches.other_writers(&self.topic, self.now().guid())
    }

    /// Takes all that came, keeps the newest. Never blocks.
    pub fn newest(&self) -> Newest<M> {
        let (mut message, mut count) = (None, 0);
        let malformed = self.each(|next, _| {
            message = Some(next);
            count += 1;
        });
        Newest { message, count, malformed }
    }

    /// Takes all that came and gives each to `take`, in their order, with where it is from; returns why others could not be decoded. Never
    /// blocks.
    pub fn each(&self, mut take: impl FnMut(M, &Origin)) -> Vec<String> {
        self.drain(Reader::take, |sample| {
            let origin = Origin::of(&sample, &self.matches);
            take(sample.into_value(), &origin);
        })
    }

    /// As [`each`](Self::each), but each message is decoded over the one before, which is in `place`: messages like those before
    /// allocate nothing.
    pub fn each_over(&self, place: &mut M, mut take: impl FnMut(&M, &Origin)) -> Vec<String>
    where
        M: InPlace,
    {
        let place = Cell::from_mut(place);
        self.drain(
            |reader| reader.take_over(place),
            |sample| {
                let origin = Origin::of(&sample, &self.matches);
                let message = sample.into_value();
                take(&message, &origin);
                place.set(message);
            },
        )
    }

    fn drain(
        &self,
        next: impl Fn(&Reader<M>) -> Result<Option<Sample<M>>, String>,
        mut take: impl FnMut(Sample<M>),
    ) -> Vec<String> {
        let (mut malformed, reader) = (Vec::new(), self.now());
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
        let mut readers = self.reader.clone();
        loop {
            let reader = readers.borrow_and_update().clone();
            tokio::select! {
                sample = reader.next() => return sample.into_value(),
                Ok(()) = readers.changed() => {}
            }
        }
    }
}
