//! Publishers and subscriptions.

use super::endpoint_names::{EndpointId, Origin};
use super::endpoints::{Endpoints, Plan};
use super::error::RosError;
use crate::dds::handover::{Inlet, Sample};
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

/// A message that its publisher may keep.
struct Shared<M>(Arc<M>);

impl<M: Serialize> Serialize for Shared<M> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.0.serialize(serializer)
    }
}

/// A message as it goes out.
type Outgoing<M> = Padded<Shared<M>>;

/// Where a publisher puts its messages.
enum Outlet<M: Message> {
    Node(ros2_client::Publisher<Outgoing<M>>),
    InTime(InTimeWriter<Outgoing<M>>),
}

/// Publishes messages of one type; never blocks.
pub struct Publisher<M: Message> {
    inner: Outlet<M>,
    publishing: Publishing,
}

/// What is the same of a publisher of any type: its topic, and who hears it.
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
        Ok(Self::of(inner.guid(), Outlet::Node(inner), endpoints, plan))
    }

    /// One whose messages are soon too old.
    pub(super) fn in_time(endpoints: &Endpoints, plan: &Plan) -> Result<Self, RosError> {
        let inner = endpoints.publisher_in_time(plan)?;
        Ok(Self::of(inner.guid(), Outlet::InTime(inner), endpoints, plan))
    }

    fn of(guid: GUID, inner: Outlet<M>, endpoints: &Endpoints, plan: &Plan) -> Self {
        let (topic, matches) = (plan.name.clone(), endpoints.domain.matches.clone());
        Self { inner, publishing: Publishing { guid, topic, dropped: AtomicU64::new(0), matches } }
    }

    /// Queues a message for all readers. One for which a frozen reader left no room is dropped and counted. Who publishes an [`Arc`] of
    /// it is its only holder again afterwards, unless later readers get it too, and can write the next one into it.
    pub fn publish(&self, message: impl Into<Arc<M>>) {
        self.send(message.into(), InTimeWriter::write);
    }

    /// The same, but a publisher in time drops and counts a message too while three of before it still wait for DDS's thread to send them.
    pub fn publish_in_time(&self, message: impl Into<Arc<M>>) {
        self.send(message.into(), InTimeWriter::write_in_time);
    }

    fn send(&self, message: Arc<M>, write: fn(&InTimeWriter<Outgoing<M>>, Outgoing<M>) -> bool) {
        let message = Padded(Shared(message));
        let queued = match &self.inner {
            Outlet::Node(publisher) => publisher.publish(message).is_ok(),
            Outlet::InTime(writer) => write(writer, message),
        };
        self.dropped.fetch_add(u64::from(!queued), Ordering::Relaxed);
    }

    /// Queues what `make` makes, where anybody subscribes: else nothing is made, and RustDDS's thread not woken.
    pub fn publish_if_heard(&self, make: impl FnOnce() -> M) {
        if self.readers() > 0 {
            self.publish(make());
        }
    }
}

impl Publishing {
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
        self.guid.into()
    }

    /// How many others publish on the topic, as far as discovery knows. One that was killed counts until its lease ends.
    pub fn other_publishers(&self) -> usize {
        self.matches.other_writers(&self.topic, self.guid)
    }

    /// How many subscribe to what this publishes.
    pub fn readers(&self) -> usize {
        self.matches.count(self.guid)
    }

    /// Waits until somebody subscribes, and then until all do of whom discovery knows, or can be said not to: a subscription that
    /// is discovered a moment later than the first one would miss what is published between.
    ///
    /// # Errors
    /// [`RosError::Write`] where nobody subscribes within `patience`.
    pub async fn wait_for_readers(&self, patience: Duration) -> Result<(), RosError> {
        let guid = self.guid;
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
    endpoints: Weak<Endpoints>,
    plan: Plan,
    message: PhantomData<fn() -> M>,
}

impl<M: Message> OwnTopic<M> {
    pub(super) fn new(endpoints: Weak<Endpoints>, plan: Plan) -> Self {
        Self { endpoints, plan, message: PhantomData }
    }

    /// How many others than the publisher `own` publish on the topic, as far as discovery knows; none where the node ends.
    pub fn other_publishers(&self, own: EndpointId) -> usize {
        let other_writers = |it: Arc<Endpoints>| it.domain.matches.other_writers(&self.plan.name, own.guid());
        self.endpoints.upgrade().map_or(0, other_writers)
    }

    /// Subscribes to it.
    ///
    /// # Errors
    /// [`RosError`].
    pub fn subscribe(&self) -> Result<Subscription<M>, RosError> {
        let ended = || RosError::create("a subscription")(&"the node has ended");
        Subscription::new(&*self.endpoints.upgrade().ok_or_else(ended)?, &self.plan)
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
    /// Another may take its place.
    inlet: watch::Receiver<Arc<Inlet<M>>>,
    topic: String,
    matches: Matches,
}

/// Makes another subscription take the place of the first.
pub(super) struct Replacement<M: Message>(watch::Sender<Arc<Inlet<M>>>);

impl<M: Message> Replacement<M> {
    /// Takes the place; what the one before has had is not taken again.
    pub fn take_place(&self, endpoints: &Endpoints, plan: &Plan) -> Result<(), RosError> {
        let next = self.0.borrow().next_by(endpoints.subscription(plan)?);
        self.0.send_replace(Arc::new(next));
        Ok(())
    }
}

/// Most messages taken at once, so that a flood cannot hold the caller for ever.
const DRAIN: usize = 1000;

impl<M: Message> Subscription<M> {
    pub(super) fn new(endpoints: &Endpoints, plan: &Plan) -> Result<Self, RosError> {
        Self::replaceable(endpoints, plan).map(|(subscription, _)| subscription)
    }

    /// One whose place another can take.
    pub(super) fn replaceable(
        endpoints: &Endpoints,
        plan: &Plan,
    ) -> Result<(Self, Replacement<M>), RosError> {
        let (place, inlet) = watch::channel(Arc::new(Inlet::new(endpoints.subscription(plan)?)));
        let (topic, matches) = (plan.name.clone(), endpoints.domain.matches.clone());
        Ok((Self { inlet, topic, matches }, Replacement(place)))
    }

    fn now(&self) -> Arc<Inlet<M>> {
        self.inlet.borrow().clone()
    }

    /// Its identity in DDS.
    pub(super) fn guid(&self) -> GUID {
        self.now().subscription().guid()
    }

    /// Why a publisher of the topic is not heard, if one is not.
    pub fn unheard(&self) -> Option<String> {
        self.matches.unheard(self.guid())
    }

    /// The topic's full name.
    pub fn topic(&self) -> &str {
        &self.topic
    }

    /// How many publish on the topic, as far as discovery knows. One that was killed counts until its lease ends.
    pub fn publishers(&self) -> usize {
        self.matches.other_writers(&self.topic, self.guid())
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
        self.drain(
            |inlet| inlet.take(inlet.subscription().async_stream()),
            |(message, info)| take(message, &Origin::new(&info, &self.matches)),
        )
    }

    /// As [`each`](Self::each), but each message is decoded over the one before, which is in `place`: messages like those before
    /// allocate nothing.
    pub fn each_over(&self, place: &mut M, mut take: impl FnMut(&M, &Origin)) -> Vec<String>
    where
        M: InPlace,
    {
        let place = Cell::from_mut(place);
        self.drain(
            |inlet| inlet.take(inlet.subscription().async_stream_seed(Reuse(place))),
            |(message, info)| {
                take(&message, &Origin::new(&info, &self.matches));
                place.set(message);
            },
        )
    }

    fn drain(
        &self,
        next: impl Fn(&Inlet<M>) -> Result<Option<Sample<M>>, String>,
        mut take: impl FnMut(Sample<M>),
    ) -> Vec<String> {
        let (mut malformed, inlet) = (Vec::new(), self.now());
        for _ in 0..DRAIN {
            match next(&inlet) {
                Ok(Some(sample)) => take(sample),
                Ok(None) => break,
                Err(why) => malformed.push(cut(&why).into_owned()),
            }
        }
        malformed
    }

    /// Waits for the next message; what cannot be decoded is passed over.
    pub async fn next(&self) -> M {
        let mut inlets = self.inlet.clone();
        loop {
            let inlet = inlets.borrow_and_update().clone();
            tokio::select! {
                message = inlet.next() => return message,
                Ok(()) = inlets.changed() => {}
            }
        }
    }
}
