//! A writer that drops a new message if several earlier messages are still unsent.
//!
//! RustDDS 0.15.1 cannot remove queued messages, and does not report their number. Its limit covers unsent and unacknowledged
//! messages together (`pubsub.rs`: `backlog_limit = window_limit`). But whenever the thread of RustDDS has sent something, RustDDS
//! wakes all tasks that wait for acknowledgments (`writer_send_buffer.rs`: `set_sent_frontier`). So this module waits for
//! acknowledgments too, and counts the messages that were queued since it was last woken. The `Publisher` of ros2-client cannot wait
//! for acknowledgments in this way. Delete this module when RustDDS has a separate limit for unsent messages.

use rustdds::dds::CreateResult;
use rustdds::no_key::DataWriterCdr;
use rustdds::{CDRSerializerAdapter, DomainParticipant, GUID, QosPolicies, RTPSEntity, Timestamp, Topic};
use serde::Serialize;
use std::future::Future;
use std::pin::pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use std::task::{Context, Wake, Waker};

/// The number of messages that may wait for the thread of RustDDS. The servo writes one command per control period. So if three
/// commands wait, the thread has sent nothing for about three control periods, and the commands become obsolete.
const MOST_WAITING: u32 = 3;

/// The number of messages that were queued since the thread of RustDDS last sent one.
#[derive(Default)]
struct Waiting(AtomicU32);

impl Wake for Waiting {
    fn wake(self: Arc<Self>) {
        self.0.store(0, Ordering::Relaxed);
    }
}

/// A writer of messages of one type. It can drop a new message if [`MOST_WAITING`] earlier messages are still unsent.
pub(crate) struct InTimeWriter<M: Serialize> {
    inner: DataWriterCdr<M>,
    waiting: Arc<Waiting>,
}

impl<M: Serialize> InTimeWriter<M> {
    /// Creates a writer to the topic.
    pub fn new(participant: &DomainParticipant, topic: &Topic) -> CreateResult<Self> {
        let publisher = participant.create_publisher(&QosPolicies::qos_none())?;
        let inner = publisher.create_datawriter_no_key::<M, CDRSerializerAdapter<M>>(topic, None)?;
        Ok(Self { inner, waiting: Arc::default() })
    }

    /// Returns the GUID of the writer.
    pub fn guid(&self) -> GUID {
        self.inner.guid()
    }

    /// Queues a message. Returns false if the queue was full; then the message is dropped.
    pub fn write(&self, message: M) -> bool {
        self.inner.write(message, Some(Timestamp::now())).is_ok()
    }

    /// Queues a message unless [`MOST_WAITING`] earlier ones still wait. Returns whether the message was queued.
    pub fn write_in_time(&self, message: M) -> bool {
        if self.waiting.0.load(Ordering::Relaxed) >= MOST_WAITING {
            return false;
        }
        self.waiting.0.fetch_add(1, Ordering::Relaxed);
        let queued = self.write(message);
        let waker = Waker::from(self.waiting.clone());
        let acknowledged = pin!(self.inner.async_wait_for_acknowledgments());
        if acknowledged.poll(&mut Context::from_waker(&waker)).is_ready() {
            self.waiting.0.store(0, Ordering::Relaxed);
        }
        queued
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::alone::outside;
    use crate::dds::sample_limits;
    use futures::StreamExt;
    use rustdds::no_key::SimpleDataReaderCdr;
    use rustdds::policy::History;
    use rustdds::{CDRDeserializerAdapter, DomainParticipantBuilder, QosPolicyBuilder, TopicKind};
    use std::net::Ipv4Addr;
    use std::sync::Mutex;
    use std::sync::mpsc::{Receiver, Sender, channel};
    use std::time::{Duration, Instant};

    const PATIENCE: Duration = Duration::from_secs(10);

    /// A waker that blocks its caller until the other end of the gate is dropped. RustDDS's thread calls the waker at each message.
    struct Gate {
        entered: Sender<()>,
        opened: Mutex<Receiver<()>>,
    }

    impl Wake for Gate {
        fn wake(self: Arc<Self>) {
            let _ = self.entered.send(());
            let _ = self.opened.lock().unwrap().recv();
        }
    }

    fn participant() -> DomainParticipant {
        DomainParticipantBuilder::new(7).with_only_networks([Ipv4Addr::LOCALHOST]).build().unwrap()
    }

    fn topic(participant: &DomainParticipant, name: &str) -> Topic {
        let qos = QosPolicyBuilder::new()
            .reliable(rustdds::Duration::ZERO)
            .history(History::KeepLast { depth: 10 });
        let qos = qos.resource_limits(sample_limits::of_writer(false)).build();
        participant.create_topic(name.to_owned(), "Number".to_owned(), &qos, TopicKind::NoKey).unwrap()
    }

    fn reader(participant: &DomainParticipant, name: &str) -> SimpleDataReaderCdr<u32> {
        let subscriber = participant.create_subscriber(&QosPolicies::qos_none()).unwrap();
        let topic = topic(participant, name);
        subscriber.create_simple_datareader_no_key::<_, CDRDeserializerAdapter<_>>(&topic, None).unwrap()
    }

    async fn hear(reader: &SimpleDataReaderCdr<u32>) -> u32 {
        let mut numbers = pin!(reader.as_async_stream());
        tokio::time::timeout(PATIENCE, numbers.next()).await.unwrap().unwrap().unwrap().into_value()
    }

    #[tokio::test(flavor = "multi_thread")]
    async fn a_message_that_would_wait_behind_three_others_is_dropped() {
        if outside("dds::send_backlog::tests::a_message_that_would_wait_behind_three_others_is_dropped") {
            return;
        }
        let (servo, robot) = (participant(), participant());
        let commands = InTimeWriter::<u32>::new(&servo, &topic(&servo, "commands")).unwrap();
        let states = InTimeWriter::<u32>::new(&robot, &topic(&robot, "states")).unwrap();
        let (heard, measured) = (reader(&robot, "commands"), reader(&servo, "states"));
        // Write until both directions work.
        let ready = async |writer: &InTimeWriter<u32>, reader: &SimpleDataReaderCdr<u32>| {
            let end = Instant::now() + PATIENCE;
            while reader.try_take_one().unwrap().is_none() {
                assert!(Instant::now() < end, "they do not meet");
                writer.write(0);
                tokio::time::sleep(Duration::from_millis(20)).await;
            }
        };
        ready(&commands, &heard).await;
        ready(&states, &measured).await;
        tokio::time::sleep(Duration::from_millis(200)).await;
        for reader in [&heard, &measured] {
            while reader.try_take_one().unwrap().is_some() {}
        }

        let ((entered, waits), (gate, opened)) = (channel(), channel());
        let waker = Waker::from(Arc::new(Gate { entered, opened: Mutex::new(opened) }));
        let mut next = pin!(measured.as_async_stream());
        assert!(next.as_mut().poll_next_unpin(&mut Context::from_waker(&waker)).is_pending());
        states.write(1);
        waits.recv_timeout(PATIENCE).unwrap();
        // Earlier messages that are not acknowledged yet may count as waiting.
        let queued = (1..=100).filter(|number| commands.write_in_time(*number)).count();
        assert!((2..=3).contains(&queued), "{queued}");
        drop(gate);
        assert_eq!([hear(&heard).await, hear(&heard).await], [1, 2]);
        let end = Instant::now() + PATIENCE;
        while !commands.write_in_time(101) {
            assert!(Instant::now() < end, "nothing is sent any more");
            tokio::time::sleep(Duration::from_millis(2)).await;
        }
    }
}
