//! A writer that queues nothing behind what waits to be sent.
//!
//! RustDDS 0.15.1 takes back nothing that it has queued, does not say how much that is, and bounds it only together with what readers have
//! not acknowledged (`pubsub.rs`: `backlog_limit = window_limit`). But it wakes those who wait for acknowledgments whenever its thread has
//! sent something (`writer_send_buffer.rs`: `set_sent_frontier`). ros2-client's `Publisher` shows nothing of this. This goes when the
//! backlog has a limit of its own.

use rustdds::dds::CreateResult;
use rustdds::no_key::DataWriterCdr;
use rustdds::{CDRSerializerAdapter, DomainParticipant, GUID, QosPolicies, RTPSEntity, Timestamp, Topic};
use serde::Serialize;
use std::future::Future;
use std::pin::pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use std::task::{Context, Wake, Waker};

/// So many messages may wait for RustDDS's thread to send them: what is older than three periods is no command any more.
const MOST_WAITING: u32 = 3;

/// How many messages have been queued since RustDDS's thread sent one.
#[derive(Default)]
struct Waiting(AtomicU32);

impl Wake for Waiting {
    fn wake(self: Arc<Self>) {
        self.0.store(0, Ordering::Relaxed);
    }
}

/// Writes messages of one type until it is dropped.
pub(crate) struct InTimeWriter<M: Serialize> {
    inner: DataWriterCdr<M>,
    waiting: Arc<Waiting>,
}

impl<M: Serialize> InTimeWriter<M> {
    /// A writer to the topic.
    pub fn new(participant: &DomainParticipant, topic: &Topic) -> CreateResult<Self> {
        let publisher = participant.create_publisher(&QosPolicies::qos_none())?;
        let inner = publisher.create_datawriter_no_key::<M, CDRSerializerAdapter<M>>(topic, None)?;
        Ok(Self { inner, waiting: Arc::default() })
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
