//! Publishers and subscriptions.

use super::endpoint_names::{EndpointId, Origin};
use super::endpoints::{Endpoints, Plan};
use super::error::RosError;
use crate::dds::handover::{ReplaceableSubscription, Sample};
use crate::dds::matches::Matches;
use crate::dds::payload_padding::Padded;
use crate::dds::send_backlog::InTimeWriter;
use dq_common::text::cut;
use dq_messages::messages::Message;
use dq_messages::{InPlace, Reuse};
use rustdds::GUID;
use serde::{Serialize, Serializer};
use std::cell::Cell;
use std::marker::PhantomData;
use std::ops::Deref;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Weak};
use std::time::Duration;
use tokio::sync::watch;

/// A message that is shared with the caller of the publisher. It is serialized like the message itself.
struct Shared<M>(Arc<M>);

impl<M: Serialize> Serialize for Shared<M> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.0.serialize(serializer)
    }
}

/// The form in which a publisher encodes a message.
type Outgoing<M> = Padded<Shared<M>>;

/// The DDS writer of a publisher.
enum DdsWriter<M: Message> {
    Node(ros2_client::Publisher<Outgoing<M>>),
    InTime(InTimeWriter<Outgoing<M>>),
}

/// Publishes messages of one type. Never blocks.
pub struct Publisher<M: Message> {
    inner: DdsWriter<M>,
    publishing: Publishing,
}

/// The part of a publisher that does not depend on the message type: its topic and its readers.
pub struct Publishing {
    guid: GUID,
    topic: String,
    dropped: AtomicU64,
    matches: Matches,
}

impl<M: Message> Deref for Publisher<M> {
    type Target = Publishing;

    fn deref(&self) -> &Publishing {
        &self.publishing
    }
}

impl<M: Message> Publisher<M> {
    pub(super) fn new(endpoints: &Endpoints, plan: &Plan) -> Result<Self, RosError> {
        let inner = endpoints.publisher(plan)?;
        Ok(Self::of(inner.guid(), DdsWriter::Node(inner), endpoints, plan))
    }

    /// Creates a publisher for messages that soon become obsolete.
    pub(super) fn in_time(endpoints: &Endpoints, plan: &Plan) -> Result<Self, RosError> {
        let inner = endpoints.publisher_in_time(plan)?;
        Ok(Self::of(inner.guid(), DdsWriter::InTime(inner), endpoints, plan))
    }

    fn of(guid: GUID, inner: DdsWriter<M>, endpoints: &Endpoints, plan: &Plan) -> Self {
        let (topic, matches) = (plan.name.clone(), endpoints.domain.matches.clone());
        Self { inner, publishing: Publishing { guid, topic, dropped: AtomicU64::new(0), matches } }
    }

    /// Queues a message for all readers. If a frozen reader has left too many earlier messages unacknowledged, the message is
    /// dropped and counted. A publisher that is not latched does not keep the [`Arc`], so the caller can write its next message into
    /// the same [`Arc`].
    pub fn publish(&self, message: impl Into<Arc<M>>) {
        self.send(message.into(), InTimeWriter::write);
    }

    /// Queues a message as `publish` does. If the publisher is for messages that soon become obsolete, and three earlier messages
    /// still wait for the DDS thread, the message is dropped and counted instead.
    pub fn publish_in_time(&self, message: impl Into<Arc<M>>) {
        self.send(message.into(), InTimeWriter::write_in_time);
    }

    fn send(&self, message: Arc<M>, write: fn(&InTimeWriter<Outgoing<M>>, Outgoing<M>) -> bool) {
        let message = Padded(Shared(message));
        let queued = match &self.inner {
            DdsWriter::Node(publisher) => publisher.publish(message).is_ok(),
            DdsWriter::InTime(writer) => write(writer, message),
        };
        self.dropped.fetch_add(u64::from(!queued), Ordering::Relaxed);
    }

    /// If there are subscribers, queues the message that `make` creates. Otherwise does nothing, so that RustDDS's thread is not woken.
    pub fn publish_if_heard(&self, make: impl FnOnce() -> M) {
        if self.readers() > 0 {
            self.publish(make());
        }
    }
}

impl Publishing {
    /// Returns the number of messages that were dropped since the publisher was created.
    pub fn dropped(&self) -> u64 {
        self.dropped.load(Ordering::Relaxed)
    }

    /// Returns the topic's full name.
    pub fn topic(&self) -> &str {
        &self.topic
    }

    /// Returns the identity of the publisher in the domain.
    pub fn id(&self) -> EndpointId {
        self.guid.into()
    }

    /// Returns the number of other publishers on the topic that discovery knows. A publisher that was killed counts until its lease
    /// ends.
    pub fn other_publishers(&self) -> usize {
        self.matches.other_writers(&self.topic, self.guid)
    }

    /// Returns the number of subscribers.
    pub fn readers(&self) -> usize {
        self.matches.count(self.guid)
    }

    /// Waits for the first subscriber, and then until all subscribers that discovery knows are matched or cannot be matched.
    /// Without this second wait, a subscription that is discovered a moment after the first would miss the messages published in
    /// between.
    ///
    /// # Errors
    /// [`RosError::Write`] if nobody subscribes within `patience`.
    pub async fn wait_for_readers(&self, patience: Duration) -> Result<(), RosError> {
        let guid = self.guid;
        let somebody = self.matches.wait_until(|matches| matches.count(guid) > 0);
        tokio::time::timeout(patience, somebody).await.map_err(|_| RosError::Write {
            topic: self.topic.clone(),
            why: format!("nobody subscribed within {} s", patience.as_secs_f64()),
        })?;
        let all = self.matches.wait_until(|matches| matches.has_all_readers(guid, &self.topic));
        // Subscribers that cannot be matched in time must not delay the others.
        let _ = tokio::time::timeout(STRAGGLERS, all).await;
        Ok(())
    }
}

/// The longest time to wait for further subscribers after the first subscriber is matched.
const STRAGGLERS: Duration = Duration::from_secs(2);

/// Creates a second endpoint on a topic that the node already uses: a subscription to a topic on which the node publishes, or a
/// publisher on a topic to which the node subscribes.
pub struct OwnTopic<M: Message> {
    endpoints: Weak<Endpoints>,
    plan: Plan,
    message: PhantomData<fn() -> M>,
}

impl<M: Message> OwnTopic<M> {
    pub(super) fn new(endpoints: Weak<Endpoints>, plan: Plan) -> Self {
        Self { endpoints, plan, message: PhantomData }
    }

    /// Returns the number of publishers on the topic that discovery knows, except the publisher `own`; 0 if the node has ended.
    pub fn other_publishers(&self, own: EndpointId) -> usize {
        let other_writers = |it: Arc<Endpoints>| it.domain.matches.other_writers(&self.plan.name, own.guid());
        self.endpoints.upgrade().map_or(0, other_writers)
    }

    /// Subscribes to the topic.
    ///
    /// # Errors
    /// [`RosError`] if the node has ended or DDS refuses.
    pub fn subscribe(&self) -> Result<Subscription<M>, RosError> {
        Subscription::new(&*self.endpoints("a subscription")?, &self.plan)
    }

    /// Creates a publisher on the topic.
    ///
    /// # Errors
    /// [`RosError`] if the node has ended or DDS refuses.
    pub fn publisher(&self) -> Result<Publisher<M>, RosError> {
        Publisher::new(&*self.endpoints("a publisher")?, &self.plan)
    }

    fn endpoints(&self, what: &str) -> Result<Arc<Endpoints>, RosError> {
        self.endpoints.upgrade().ok_or_else(|| RosError::create(what)(&"the node has ended"))
    }
}

/// The result of taking all received messages at once: the newest message, and the number of messages.
pub struct Newest<M> {
    /// The newest message, if any.
    pub message: Option<M>,
    /// The number of taken messages that could be decoded.
    pub count: u64,
    /// The reasons why some messages could not be decoded.
    pub malformed: Vec<String>,
}

/// Receives messages of one type.
pub struct Subscription<M: Message> {
    /// The DDS reader. A [`Replacement`] can put another reader here.
    reader: watch::Receiver<Arc<ReplaceableSubscription<M>>>,
    topic: String,
    matches: Matches,
}

/// Replaces the reader of a subscription.
pub(super) struct Replacement<M: Message>(watch::Sender<Arc<ReplaceableSubscription<M>>>);

impl<M: Message> Replacement<M> {
    /// Replaces the reader. The new reader skips messages that the previous reader has taken.
    pub fn take_place(&self, endpoints: &Endpoints, plan: &Plan) -> Result<(), RosError> {
        let next = self.0.borrow().replaced_by(endpoints.subscription(plan)?);
        self.0.send_replace(Arc::new(next));
        Ok(())
    }
}

/// The largest number of messages taken at once, so that a flood cannot block the caller forever.
const DRAIN: usize = 1000;

impl<M: Message> Subscription<M> {
    pub(super) fn new(endpoints: &Endpoints, plan: &Plan) -> Result<Self, RosError> {
        Self::replaceable(endpoints, plan).map(|(subscription, _)| subscription)
    }

    /// Creates a subscription whose reader can be replaced.
    pub(super) fn replaceable(
        endpoints: &Endpoints,
        plan: &Plan,
    ) -> Result<(Self, Replacement<M>), RosError> {
        let (place, reader) =
            watch::channel(Arc::new(ReplaceableSubscription::new(endpoints.subscription(plan)?)));
        let (topic, matches) = (plan.name.clone(), endpoints.domain.matches.clone());
        Ok((Self { reader, topic, matches }, Replacement(place)))
    }

    fn now(&self) -> Arc<ReplaceableSubscription<M>> {
        self.reader.borrow().clone()
    }

    /// Returns the GUID of the present reader.
    pub(super) fn guid(&self) -> GUID {
        self.now().subscription().guid()
    }

    /// Returns the reason why this subscription cannot receive from a publisher of the topic; `None` if there is no such publisher.
    pub fn unheard(&self) -> Option<String> {
        self.matches.unheard(self.guid())
    }

    /// Returns the topic's full name.
    pub fn topic(&self) -> &str {
        &self.topic
    }

    /// Returns the number of publishers on the topic that discovery knows. A publisher that was killed counts until its lease ends.
    pub fn publishers(&self) -> usize {
        self.matches.other_writers(&self.topic, self.guid())
    }

    /// Takes all received messages, and returns the newest. Never blocks.
    pub fn newest(&self) -> Newest<M> {
        let (mut message, mut count) = (None, 0);
        let malformed = self.each(|next, _| {
            message = Some(next);
            count += 1;
        });
        Newest { message, count, malformed }
    }

    /// Takes all received messages, and passes each to `take` in order, with its origin. Returns the reasons why other messages
    /// could not be decoded. Never blocks.
    pub fn each(&self, mut take: impl FnMut(M, &Origin)) -> Vec<String> {
        self.drain(
            |reader| reader.take(reader.subscription().async_stream()),
            |(message, info)| take(message, &Origin::new(&info, &self.matches)),
        )
    }

    /// Does the same as [`each`](Self::each), but decodes each message into the memory of the previous message, which is in `place`.
    /// So messages whose lists have the same lengths cause no allocations.
    pub fn each_over(&self, place: &mut M, mut take: impl FnMut(&M, &Origin)) -> Vec<String>
    where
        M: InPlace,
    {
        let place = Cell::from_mut(place);
        self.drain(
            |reader| reader.take(reader.subscription().async_stream_seed(Reuse(place))),
            |(message, info)| {
                take(&message, &Origin::new(&info, &self.matches));
                place.set(message);
            },
        )
    }

    fn drain(
        &self,
        next: impl Fn(&ReplaceableSubscription<M>) -> Result<Option<Sample<M>>, String>,
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

    /// Waits for the next message. Messages that cannot be decoded are skipped.
    pub async fn next(&self) -> M {
        let mut readers = self.reader.clone();
        loop {
            let reader = readers.borrow_and_update().clone();
            tokio::select! {
                message = reader.next() => return message,
                Ok(()) = readers.changed() => {}
            }
        }
    }
}
