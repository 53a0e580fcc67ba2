//! Writers.

use super::announcement::Announced;
use rustdds::no_key::DataWriterCdr;
use rustdds::{GUID, RTPSEntity, SampleIdentity, Timestamp, WriteOptions};
use serde::Serialize;
use std::future::Future;
use std::pin::pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use std::task::{Context, Wake, Waker};

/// So many messages of a cycle may wait for RustDDS's thread to send them: what is older than three periods is no command any more.
const MOST_WAITING: u32 = 3;

/// How many messages have been queued since RustDDS's thread sent one.
#[derive(Default)]
struct Waiting(AtomicU32);

impl Wake for Waiting {
    fn wake(self: Arc<Self>) {
        self.0.store(0, Ordering::Relaxed);
    }
}

/// Writes messages of one type, for its node until it is dropped.
pub(super) struct Writer<M: Serialize> {
    inner: DataWriterCdr<M>,
    _announced: Option<Announced>,
    waiting: Arc<Waiting>,
}

impl<M: Serialize + Send + Sync + 'static> Writer<M> {
    pub fn new(inner: DataWriterCdr<M>, announced: Option<Announced>) -> Self {
        Self { inner, _announced: announced, waiting: Arc::default() }
    }

    /// Its identity in DDS.
    pub fn guid(&self) -> GUID {
        self.inner.guid()
    }

    /// Queues a message; whether there was room.
    pub fn write(&self, message: M) -> bool {
        self.inner.write(message, Some(Timestamp::now())).is_ok()
    }

    /// Queues a message unless [`MOST_WAITING`] of before still wait to be sent; whether it did.
    ///
    /// RustDDS takes back nothing that it has queued, and does not say how much that is. But it wakes those who wait for
    /// acknowledgments whenever its thread has sent something (0.15.1, `writer_send_buffer.rs`: `set_sent_frontier`).
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

    /// Queues a message, and waits for room; the sample's identity, or why there is none.
    pub async fn write_with(&self, message: M, options: WriteOptions) -> Result<SampleIdentity, String> {
        self.inner.async_write_with_options(message, options).await.map_err(|why| why.to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ros::alone::{node, outside};
    use crate::wire::messages::{Float64MultiArray, JointState};
    use crate::wire::{Contract, command_array};
    use std::sync::Mutex;
    use std::sync::mpsc::{Receiver, Sender, channel};
    use std::time::{Duration, Instant};

    const PATIENCE: Duration = Duration::from_secs(10);

    /// Keeps whoever wakes it until its other end is dropped: RustDDS's thread, which tells so of a message.
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

    #[tokio::test(flavor = "multi_thread")]
    async fn what_would_wait_behind_three_others_is_dropped_and_counted() {
        if outside("ros::writer::tests::what_would_wait_behind_three_others_is_dropped_and_counted") {
            return;
        }
        let ((_one, mut servo), (_other, mut robot)) = (node("servo"), node("robot"));
        let contract = Contract::builtin().unwrap();
        const COMMANDS: &str = "forward_velocity_controller/commands";
        let commands = servo.publisher::<Float64MultiArray>(&contract.servo, COMMANDS).unwrap();
        let heard = robot.subscription::<Float64MultiArray>(&contract.plant, COMMANDS).unwrap();
        let measured = servo.subscription::<JointState>(&contract.servo, "joint_states").unwrap();
        let states = robot.publisher::<JointState>(&contract.plant, "joint_states").unwrap();
        commands.wait_for_readers(PATIENCE).await.unwrap();
        states.wait_for_readers(PATIENCE).await.unwrap();
        let send = |number: u32| commands.publish_in_time(command_array(vec![f64::from(number)], ""));
        let hear = async || tokio::time::timeout(PATIENCE, heard.next()).await.unwrap().data[0];
        send(0);
        assert_eq!(hear().await, 0.0);

        let ((entered, waits), (gate, opened)) = (channel(), channel());
        let waker = Waker::from(Arc::new(Gate { entered, opened: Mutex::new(opened) }));
        let mut next = pin!(measured.next());
        assert!(next.as_mut().poll(&mut Context::from_waker(&waker)).is_pending());
        states.publish(JointState::default());
        waits.recv_timeout(PATIENCE).unwrap();
        // What was sent before may not have been acknowledged, and so count as waiting.
        (1..=100).for_each(send);
        let dropped = commands.dropped();
        assert!((97..=98).contains(&dropped), "{dropped}");
        drop(gate);
        let waited: Vec<_> = [hear().await, hear().await].into();
        assert_eq!(waited, [1.0, 2.0]);
        let end = Instant::now() + PATIENCE;
        while hear_now(&heard) != Some(101.0) {
            assert!(Instant::now() < end, "nothing is sent any more");
            send(101);
            tokio::time::sleep(Duration::from_millis(2)).await;
        }
    }

    fn hear_now(heard: &crate::ros::Subscription<Float64MultiArray>) -> Option<f64> {
        heard.newest().message.map(|command| command.data[0])
    }
}
