//! Records the topics of a running graph.

use super::RecordingError;
use super::queue::{Progress, Queue, WritingThread};
use super::selection::Selection;
use dq_bags::{BagError, BagWriter, TopicRecord, WriterOptions, WrittenBag};
use dq_messages::{DurabilityKind, OfferedQos, ReliabilityKind, definition};
use dq_ros::ros::{GraphTopic, Logger, NetworkWatch, Node, RawSubscription};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use tokio::sync::watch;
use tokio::task::{JoinHandle, JoinSet};

/// Records the messages that other participants publish, from the start until [`Recorder::finish`]. Topics that appear later are
/// recorded from then on.
pub struct Recorder {
    thread: WritingThread,
    queue: Queue,
    watcher: JoinHandle<()>,
    recorded: watch::Receiver<BTreeSet<String>>,
    heard: watch::Sender<BTreeSet<String>>,
}

impl Recorder {
    /// Begins a bag in `directory`, which must not exist yet. `node` should have its own session, because topics of the same session are
    /// not recorded. Must be called within a tokio runtime.
    ///
    /// # Errors
    /// [`RecordingError`] if the bag or the writing thread cannot be created.
    pub fn start(
        node: Node,
        directory: &Path,
        selection: Selection,
        options: WriterOptions,
    ) -> Result<Self, RecordingError> {
        let (queue, thread) = WritingThread::start(BagWriter::create(directory, options)?)?;
        let (report, recorded) = watch::channel(BTreeSet::new());
        let heard = watch::Sender::new(BTreeSet::new());
        let watcher = Watcher {
            node,
            selection,
            queue: queue.clone(),
            receiving: BTreeMap::new(),
            refused: BTreeSet::new(),
            report,
            tell_heard: heard.clone(),
        };
        let watcher = tokio::spawn(watcher.run());
        Ok(Self { thread, queue, watcher, recorded, heard })
    }

    /// Returns the numbers of messages that were written and dropped.
    pub fn progress(&self) -> Progress {
        self.queue.progress()
    }

    /// Returns the topics that the recorder subscribes to and that have a publisher.
    pub fn topics(&self) -> BTreeSet<String> {
        self.recorded.borrow().clone()
    }

    /// Waits up to `patience` until the recorder subscribes to all these topics and each has a publisher. Returns whether this is
    /// so. A publisher may discover the recorder some milliseconds later. To lose no message, the publisher must itself wait for a
    /// subscriber.
    pub async fn wait_for(&self, topics: &[&str], patience: Duration) -> bool {
        contains(&self.recorded, topics, patience).await
    }

    /// Waits up to `patience` until a message of each of these topics has arrived. Returns whether a message of every topic has
    /// arrived.
    pub async fn wait_for_messages(&self, topics: &[&str], patience: Duration) -> bool {
        contains(&self.heard.subscribe(), topics, patience).await
    }

    /// Waits as [`wait_for_messages`](Self::wait_for_messages) does, but counts only messages that arrive during this call.
    pub async fn wait_for_next_messages(&self, topics: &[&str], patience: Duration) -> bool {
        self.heard.send_modify(|heard| heard.retain(|topic| !topics.contains(&topic.as_str())));
        self.wait_for_messages(topics, patience).await
    }

    /// Waits until writing fails, and returns the reason. [`Recorder::finish`] then returns the same error.
    pub fn write_failure(&self) -> impl Future<Output = String> + Send + use<> {
        self.thread.failed()
    }

    /// Waits until writing fails or this process loses the network. [`Recorder::finish`] then returns the reason.
    pub async fn failed(&self) {
        tokio::select! {
            _ = self.write_failure() => {}
            _ = NetworkWatch::ended() => {}
        }
    }

    /// Stops receiving, writes what has been received, and closes the bag.
    ///
    /// # Errors
    /// The error of writing; [`RecordingError::Deaf`] if the bag is valid but lacks the last messages.
    pub async fn finish(self) -> Result<WrittenBag, RecordingError> {
        let Self { thread, queue, watcher, .. } = self;
        let heard = NetworkWatch::default().check();
        // Let the receivers take the messages that have arrived.
        tokio::time::sleep(LAST_TAKE).await;
        watcher.abort();
        // The task ends as aborted. Its subscriptions and their ends of the queue are dropped with it.
        let _ = watcher.await;
        drop(queue);
        let joined = tokio::task::spawn_blocking(|| thread.join()).await;
        let summary = joined.map_err(|why| RecordingError::Thread(why.to_string()))??;
        match heard {
            Ok(()) => Ok(summary),
            Err(why) => Err(RecordingError::Deaf { messages: summary.messages, why }),
        }
    }
}

/// How long the receivers continue after the request to end the recording, to take the messages that have already arrived.
const LAST_TAKE: Duration = Duration::from_millis(100);

/// The QoS of a subscription.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Delivery {
    reliable: bool,
    transient_local: bool,
}

impl Delivery {
    /// Returns the presumed QoS of a topic that has no publisher yet: as its subscribers request, otherwise the default of ROS 2's
    /// publishers. A wrong presumption costs a second subscription, and in a secured graph RustDDS 0.15.1 delivers nothing to it.
    fn presumed(topic: &GraphTopic) -> Self {
        Self { reliable: true, transient_local: topic.is_requested_latched }
    }

    /// Returns the strictest QoS that all publishers offer; `None` without a publisher.
    fn of(offered: &[OfferedQos]) -> Option<Self> {
        let all = |test: fn(&OfferedQos) -> bool| offered.iter().all(test);
        (!offered.is_empty()).then(|| Self {
            reliable: all(|qos| qos.reliability == ReliabilityKind::Reliable),
            transient_local: all(|qos| qos.durability == DurabilityKind::TransientLocal),
        })
    }

    /// Returns the strictest QoS that both offer: reliable if both are reliable, and transient local if both are transient local.
    fn and(self, other: Self) -> Self {
        Self {
            reliable: self.reliable && other.reliable,
            transient_local: self.transient_local && other.transient_local,
        }
    }
}

/// A topic's subscription, and the task that reads the subscription. Both end when this value is dropped.
struct Receiving {
    /// The QoS of the subscription.
    delivery: Delivery,
    /// Whether a publisher has appeared, so that the bag has the topic.
    has_publisher: bool,
    message: String,
    sequences: Sequences,
    _task: JoinSet<()>,
}

/// Follows the graph and subscribes to new topics.
struct Watcher {
    node: Node,
    selection: Selection,
    queue: Queue,
    receiving: BTreeMap<String, Receiving>,
    /// The reasons why topics cannot be recorded. Each reason is logged once.
    refused: BTreeSet<String>,
    report: watch::Sender<BTreeSet<String>>,
    tell_heard: watch::Sender<BTreeSet<String>>,
}

impl Watcher {
    async fn run(mut self) {
        loop {
            for (name, topic) in self.node.graph() {
                if self.selection.has(&name, &topic.message) {
                    self.follow(&name, &topic);
                }
            }
            self.node.graph_change().await;
        }
    }

    /// Subscribes to the topic. If a new publisher offers weaker QoS, subscribes again with that QoS. Never subscribes again with
    /// stricter QoS after a publisher has left, because the other publishers would send their latched messages again.
    fn follow(&mut self, name: &str, topic: &GraphTopic) {
        if let Some(before) = self.receiving.get(name).map(|receiving| &receiving.message)
            && *before != topic.message
        {
            // A bag with two types under one name could not be played.
            let GraphTopic { message, .. } = topic;
            return self.warn(format!(
                "{name} now has the type {message}: only messages of the type {before} are recorded"
            ));
        }
        let offered = Delivery::of(&topic.offered);
        let Some(receiving) = self.receiving.get_mut(name) else {
            return self.subscribe(name, topic, offered);
        };
        let Some(offered) = offered else { return };
        let suitable = if receiving.has_publisher { receiving.delivery.and(offered) } else { offered };
        if suitable != receiving.delivery {
            self.subscribe(name, topic, Some(suitable));
        } else if !receiving.has_publisher {
            receiving.has_publisher = true;
            self.announce(&Arc::new(record(name, topic)));
        }
    }

    /// Subscribes to the topic with the QoS `offered` by its publishers, or without a publisher with the presumed one.
    fn subscribe(&mut self, name: &str, topic: &GraphTopic, offered: Option<Delivery>) {
        if definition(&topic.message).is_none() {
            let message = topic.message.clone();
            return self.warn(BagError::UnknownType { topic: name.to_owned(), message }.to_string());
        }
        // The old subscription ends before the new one begins. Messages that arrive in between are missed, and counted.
        let sequences = self.receiving.remove(name).map(|old| old.sequences.clone()).unwrap_or_default();
        let delivery = offered.unwrap_or_else(|| Delivery::presumed(topic));
        let Delivery { reliable, transient_local } = delivery;
        let subscription = self.node.raw_subscription(name, &topic.message, reliable, transient_local);
        let record = Arc::new(record(name, topic));
        match subscription {
            Ok(subscription) => {
                if offered.is_some() {
                    self.announce(&record);
                }
                let receiver = Receiver {
                    topic: record,
                    queue: self.queue.clone(),
                    heard: self.tell_heard.clone(),
                    sequences: sequences.clone(),
                    log: self.node.log().clone(),
                };
                let (message, mut task) = (topic.message.clone(), JoinSet::new());
                task.spawn(receiver.run(subscription));
                let has_publisher = offered.is_some();
                let receiving = Receiving { delivery, has_publisher, message, sequences, _task: task };
                self.receiving.insert(name.to_owned(), receiving);
            }
            Err(why) => self.warn(why.to_string()),
        }
    }

    fn announce(&mut self, topic: &Arc<TopicRecord>) {
        self.queue.topic(topic);
        self.report.send_if_modified(|recorded| recorded.insert(topic.name.clone()));
    }

    fn warn(&mut self, why: String) {
        if self.refused.insert(why.clone()) {
            self.node.log().warn(&why);
        }
    }
}

fn record(name: &str, topic: &GraphTopic) -> TopicRecord {
    TopicRecord { offered: topic.offered.clone(), ..TopicRecord::new(name, &*topic.message) }
}

/// The last sequence number of each publisher of a topic.
#[derive(Clone, Default)]
struct Sequences(Arc<Mutex<HashMap<[u8; 16], i64>>>);

impl Sequences {
    /// Returns how many earlier messages of the publisher were missed. `None` if the message is a repetition.
    fn take(&self, publisher: [u8; 16], sequence: i64) -> Option<u64> {
        let mut last = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let missed = match last.get(&publisher) {
            Some(last) if sequence <= *last => return None,
            Some(last) => sequence.abs_diff(*last) - 1,
            // The number of messages before the first one received is unknown.
            None => 0,
        };
        last.insert(publisher, sequence);
        Some(missed)
    }
}

/// Reads messages from one subscription and adds them to the queue of the writing thread.
struct Receiver {
    topic: Arc<TopicRecord>,
    queue: Queue,
    heard: watch::Sender<BTreeSet<String>>,
    sequences: Sequences,
    log: Logger,
}

impl Receiver {
    async fn run(self, mut subscription: RawSubscription) {
        while let Some(message) = subscription.next().await {
            // A second subscription to the topic receives latched messages again. Such repetitions are skipped.
            let Some(missed) = self.sequences.take(message.publisher, message.sequence) else { continue };
            self.queue.lost(missed);
            self.queue.message(&self.topic, message.received, message.sent, message.cdr);
            if !self.heard.borrow().contains(&self.topic.name) {
                self.heard.send_if_modified(|heard| heard.insert(self.topic.name.clone()));
            }
        }
        self.log.warn(&format!(
            "the messages of {} have grown too large: they are no longer recorded",
            self.topic.name
        ));
    }
}

/// Waits up to `patience` until all these topics are in the set. Returns whether all of them are in it.
async fn contains(set: &watch::Receiver<BTreeSet<String>>, topics: &[&str], patience: Duration) -> bool {
    let mut set = set.clone();
    let all = set.wait_for(|set| topics.iter().all(|topic| set.contains(*topic)));
    tokio::time::timeout(patience, all).await.is_ok_and(|all| all.is_ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_message_counts_once_and_gaps_are_counted() {
        let (sequences, one, other) = (Sequences::default(), [1; 16], [2; 16]);
        let taken = [(one, 7), (one, 8), (other, 1), (one, 8), (one, 12), (other, 2)];
        let taken = taken.map(|(publisher, sequence)| sequences.take(publisher, sequence));
        assert_eq!(taken, [Some(0), Some(0), Some(0), None, Some(3), Some(0)]);
    }

    #[test]
    fn publishers_that_differ_are_subscribed_to_with_settings_that_all_offer() {
        let qos = |reliability, durability| OfferedQos {
            reliability,
            durability,
            deadline: None,
            lifespan: None,
            liveliness: dq_messages::LivelinessKind::Automatic,
            liveliness_lease: None,
        };
        let latched = qos(ReliabilityKind::Reliable, DurabilityKind::TransientLocal);
        let lossy = qos(ReliabilityKind::BestEffort, DurabilityKind::TransientLocal);
        assert_eq!(Delivery::of(&[]), None);
        let both = Delivery { reliable: true, transient_local: true };
        assert_eq!(Delivery::of(std::slice::from_ref(&latched)), Some(both));
        let less = Delivery { reliable: false, transient_local: true };
        assert_eq!(Delivery::of(&[latched, lossy]), Some(less));
        assert_eq!(both.and(less), less);
    }
}
