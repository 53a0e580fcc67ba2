//! A subscription that takes the place of another.
//!
//! RustDDS 0.15.1 gives a new reader what it still keeps of the topic, though it is volatile, so that a message would be taken twice. And
//! its notifications, which ros2-client drains each time that it takes, cost an allocation and a system call. This goes when test `lib`
//! a_cycle_allocates_… passes with `ros2_client::Subscription::take`, and volatile readers begin with what comes after them.

use futures::Stream;
use ros2_client::error::{ReadError, ReadResult};
use ros2_client::{MessageInfo, Subscription};
use serde::de::DeserializeOwned;
use std::pin::pin;
use std::sync::atomic::{AtomicI64, Ordering};
use std::task::{Context, Poll, Waker};

/// A subscription of ros2-client, to which another may have given way.
pub(crate) struct Inlet<M> {
    inner: Subscription<M>,
    /// What came until then was for the one before \[ns\].
    since: i64,
    /// When the newest message came that was taken \[ns\].
    newest: AtomicI64,
}

/// A message as it came, with what DDS says of it.
pub(crate) type Sample<M> = (M, MessageInfo);

impl<M: DeserializeOwned + 'static> Inlet<M> {
    pub fn new(inner: Subscription<M>) -> Self {
        Self::since(i64::MIN, inner)
    }

    /// What takes the place of this one.
    pub fn next_by(&self, inner: Subscription<M>) -> Self {
        Self::since(self.newest.load(Ordering::Relaxed), inner)
    }

    fn since(since: i64, inner: Subscription<M>) -> Self {
        Self { inner, since, newest: AtomicI64::new(since) }
    }

    /// What ros2-client has of it.
    pub fn subscription(&self) -> &Subscription<M> {
        &self.inner
    }

    /// The next message of `samples`, if one has come; or why it could not be decoded.
    ///
    /// `ros2_client::Subscription::take` drains RustDDS's notifications first, an allocation and a system call each time. A stream that is
    /// polled for nobody does neither.
    pub fn take(
        &self,
        samples: impl Stream<Item = ReadResult<Sample<M>>>,
    ) -> Result<Option<Sample<M>>, String> {
        let mut samples = pin!(samples);
        loop {
            match samples.as_mut().poll_next(&mut Context::from_waker(Waker::noop())) {
                Poll::Ready(Some(Ok(sample))) if self.is_new(&sample) => return Ok(Some(sample)),
                Poll::Ready(Some(Ok(_))) => {}
                Poll::Ready(Some(Err(why))) => return Err(reason(why)),
                Poll::Ready(None) | Poll::Pending => return Ok(None),
            }
        }
    }

    /// Waits for the next message that can be decoded.
    pub async fn next(&self) -> M {
        loop {
            match self.inner.async_take().await {
                Ok(sample) if self.is_new(&sample) => return sample.0,
                _ => {}
            }
        }
    }

    /// Whether the one before has not had it. RustDDS stamps what comes to a topic with times that always rise, wherever the clock goes.
    fn is_new(&self, (_, info): &Sample<M>) -> bool {
        let received = info.received_timestamp().map_or(i64::MAX, |time| time.to_nanos());
        self.newest.fetch_max(received, Ordering::Relaxed);
        received > self.since
    }
}

/// Why a message could not be decoded. Nothing is put together here: a thousand of them may come in a cycle.
fn reason(why: ReadError) -> String {
    match why {
        ReadError::Deserialization { reason } => reason,
        other => other.to_string(),
    }
}
