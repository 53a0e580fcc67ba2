//! The thread that writes a bag. It has a bounded queue, so that a slow disk never blocks the receivers.

use super::RecordingError;
use dq_bags::{BagError, BagWriter, TopicId, TopicRecord, WrittenBag};
use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use tokio::sync::watch;

/// The largest number of items in the queue: six seconds of ten topics at 1 kHz.
const CAPACITY: usize = 65_536;

/// The largest total size of the messages in the queue \[bytes\]. A single message may be larger.
const ROOM: usize = 64 << 20;

/// The interval at which the bag is flushed to the disk.
const FLUSH: Duration = Duration::from_millis(500);

/// An item for the writer.
enum Item {
    Topic(Arc<TopicRecord>),
    Message { topic: Arc<TopicRecord>, log_time: i64, publish_time: i64, cdr: Vec<u8> },
}

/// Counters shared by both ends of the queue.
#[derive(Default)]
struct Counts {
    written: AtomicU64,
    dropped: AtomicU64,
    /// The size of the messages that wait for the writer \[bytes\].
    waiting: AtomicUsize,
}

/// The numbers of messages that were written and dropped since the start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// The number of messages in the bag.
    pub written: u64,
    /// The number of lost messages.
    pub dropped: u64,
}

/// The end of the queue into which the receivers of messages put them. Putting a message never blocks.
#[derive(Clone)]
pub(super) struct Queue {
    items: SyncSender<Item>,
    counts: Arc<Counts>,
}

impl Queue {
    /// Announces a topic, so that the bag has the topic even if no message arrives.
    pub fn topic(&self, topic: &Arc<TopicRecord>) {
        // If the queue is full, the topic will be added with its first message.
        let _ = self.items.try_send(Item::Topic(topic.clone()));
    }

    /// Queues a message. If the queue has no room, counts the message as dropped.
    pub fn message(&self, topic: &Arc<TopicRecord>, log_time: i64, publish_time: i64, cdr: Vec<u8>) {
        let size = cdr.len();
        let before = self.counts.waiting.fetch_add(size, Ordering::Relaxed);
        let has_room = before == 0 || before + size <= ROOM;
        let item = Item::Message { topic: topic.clone(), log_time, publish_time, cdr };
        if !has_room || self.items.try_send(item).is_err() {
            self.counts.waiting.fetch_sub(size, Ordering::Relaxed);
            self.lost(1);
        }
    }

    /// Adds `count` messages that were published but not received to the dropped messages.
    pub fn lost(&self, count: u64) {
        self.counts.dropped.fetch_add(count, Ordering::Relaxed);
    }

    /// Returns the progress of the recording.
    pub fn progress(&self) -> Progress {
        let [written, dropped] =
            [&self.counts.written, &self.counts.dropped].map(|count| count.load(Ordering::Relaxed));
        Progress { written, dropped }
    }
}

/// The writing thread. It ends once every [`Queue`] has been dropped and all items are written.
pub(super) struct WritingThread {
    handle: JoinHandle<Result<WrittenBag, RecordingError>>,
    counts: Arc<Counts>,
    /// The error that ended the thread; `None` if the thread has not failed. The channel closes when the thread ends.
    failure: watch::Receiver<Option<String>>,
}

impl WritingThread {
    /// Starts writing into `bag`.
    ///
    /// # Errors
    /// [`RecordingError::Thread`].
    pub fn start(bag: BagWriter) -> Result<(Queue, Self), RecordingError> {
        let (items, receiver) = sync_channel(CAPACITY);
        let counts = Arc::new(Counts::default());
        let (tell, failure) = watch::channel(None);
        let sink = Sink { bag, topics: HashMap::new(), counts: counts.clone() };
        let run = move || {
            // The error is published only after `run` has closed the queue. So nobody who reads the error can queue more messages.
            sink.run(receiver)
                .inspect_err(|why| drop(tell.send_replace(Some(why.to_string()))))
                .map_err(RecordingError::from)
        };
        let handle = std::thread::Builder::new()
            .name("bag writer".to_owned())
            .spawn(run)
            .map_err(|why| RecordingError::Thread(format!("could not start: {why}")))?;
        Ok((Queue { items, counts: counts.clone() }, Self { handle, counts, failure }))
    }

    /// Waits until the thread has ended by an error, and returns the error.
    pub fn failed(&self) -> impl Future<Output = String> + Send + use<> {
        let mut failure = self.failure.clone();
        async move {
            let why = failure.wait_for(Option::is_some).await.map(|why| why.clone());
            why.ok().flatten().unwrap_or_else(|| RecordingError::Thread("has ended".to_owned()).to_string())
        }
    }

    /// Waits until all items are written. Every [`Queue`] must have been dropped.
    ///
    /// # Errors
    /// The error of writing.
    pub fn join(self) -> Result<WrittenBag, RecordingError> {
        let written = self.handle.join().map_err(|_| RecordingError::Thread("panicked".to_owned()))?;
        let dropped = self.counts.dropped.load(Ordering::Relaxed);
        written.map(|summary| WrittenBag { dropped, ..summary })
    }
}

/// The writer's end of the queue.
struct Sink {
    bag: BagWriter,
    /// The topics in the bag, by name. If a topic is queued again, for example with other publishers, its first entry remains.
    topics: HashMap<String, TopicId>,
    counts: Arc<Counts>,
}

impl Sink {
    fn run(mut self, items: Receiver<Item>) -> Result<WrittenBag, BagError> {
        let mut flush_at = Instant::now() + FLUSH;
        loop {
            match items.recv_timeout(flush_at.saturating_duration_since(Instant::now())) {
                Ok(item) => self.take(item)?,
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return self.bag.finish(),
            }
            if Instant::now() >= flush_at {
                self.bag.flush()?;
                flush_at = Instant::now() + FLUSH;
            }
        }
    }

    fn take(&mut self, item: Item) -> Result<(), BagError> {
        match item {
            Item::Topic(topic) => self.id(&topic).map(drop),
            Item::Message { topic, log_time, publish_time, cdr } => {
                let id = self.id(&topic)?;
                self.bag.write(id, log_time, publish_time, &cdr)?;
                self.counts.waiting.fetch_sub(cdr.len(), Ordering::Relaxed);
                self.counts.written.fetch_add(1, Ordering::Relaxed);
                Ok(())
            }
        }
    }

    fn id(&mut self, topic: &TopicRecord) -> Result<TopicId, BagError> {
        if let Some(id) = self.topics.get(&topic.name) {
            return Ok(*id);
        }
        let id = self.bag.add_topic(topic)?;
        self.topics.insert(topic.name.clone(), id);
        Ok(id)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dq_bags::{Bag, WriterOptions};

    fn topic() -> Arc<TopicRecord> {
        Arc::new(TopicRecord::new("/text", "std_msgs/msg/String"))
    }

    #[test]
    fn ten_minutes_at_1_khz_on_two_topics_go_through_and_none_is_dropped() {
        const MESSAGES: u64 = 1_200_000;
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("bag");
        let (queue, thread) =
            WritingThread::start(BagWriter::create(&path, WriterOptions::default()).unwrap()).unwrap();
        let topics = ["/even", "/odd"]
            .map(|name| Arc::new(TopicRecord { name: name.to_owned(), ..(*topic()).clone() }));
        for number in 0..MESSAGES {
            let mut cdr = vec![0; 120];
            cdr[..8].copy_from_slice(&number.to_le_bytes());
            // The numbers change like those of a moving arm.
            cdr[112..].copy_from_slice(&(number as f64 * 1e-3).sin().to_le_bytes());
            // Do not send faster than the writer writes: a full queue would drop messages.
            while number - queue.progress().written > 50_000 {
                std::thread::yield_now();
            }
            queue.message(&topics[number as usize % 2], i64::try_from(number).unwrap(), 0, cdr);
        }
        drop(queue);
        let summary = thread.join().unwrap();
        assert_eq!((summary.messages, summary.dropped), (MESSAGES, 0));
        let mut bag = Bag::open(&path).unwrap();
        let mut next = 0_u64;
        for message in bag.by_ref() {
            let name = if next.is_multiple_of(2) { "/even" } else { "/odd" };
            assert!(message.cdr[..8] == next.to_le_bytes() && &*message.topic == name, "{next}");
            next += 1;
        }
        assert_eq!(next, MESSAGES);
        assert!(bag.topics().len() == 2 && bag.topics().iter().all(|topic| topic.count == MESSAGES / 2));
    }

    #[test]
    fn messages_beyond_the_capacity_are_dropped_and_counted_without_waiting() {
        let directory = tempfile::tempdir().unwrap();
        let bag = BagWriter::create(&directory.path().join("bag"), WriterOptions::default()).unwrap();
        let (items, receiver) = sync_channel(CAPACITY);
        let counts = Arc::new(Counts::default());
        let queue = Queue { items, counts: counts.clone() };
        // At this time no thread writes.
        (0..CAPACITY + 10).for_each(|_| queue.message(&topic(), 0, 0, vec![0; 8]));
        assert_eq!(queue.progress(), Progress { written: 0, dropped: 10 });
        drop(queue);
        let summary = Sink { bag, topics: HashMap::new(), counts }.run(receiver).unwrap();
        assert_eq!(summary.messages, u64::try_from(CAPACITY).unwrap());
    }

    #[test]
    fn the_queue_is_limited_in_bytes_too() {
        let (items, receiver) = sync_channel(CAPACITY);
        let queue = Queue { items, counts: Arc::default() };
        (0..500).for_each(|_| queue.message(&topic(), 0, 0, vec![0; 1 << 20]));
        assert_eq!((queue.progress().dropped, receiver.try_iter().count()), (436, 64));
        let alone = Queue { items: sync_channel(1).0, counts: Arc::default() };
        alone.message(&topic(), 0, 0, vec![0; ROOM + 1]);
        assert_eq!(alone.progress().dropped, 1, "nobody takes it");
    }

    #[tokio::test]
    async fn an_error_ends_the_thread_and_is_reported() {
        let directory = tempfile::tempdir().unwrap();
        let bag = BagWriter::create(&directory.path().join("bag"), WriterOptions::default()).unwrap();
        let (queue, thread) = WritingThread::start(bag).unwrap();
        let unknown = TopicRecord { message: "a/msg/B".to_owned(), ..(*topic()).clone() };
        queue.topic(&Arc::new(unknown));
        assert!(thread.failed().await.contains("type a/msg/B has no definition"));
        queue.message(&topic(), 0, 0, vec![0; 4]);
        assert_eq!(queue.progress().dropped, 1);
        drop(queue);
        assert!(matches!(thread.join(), Err(RecordingError::Bag(BagError::UnknownType { .. }))));
    }
}
