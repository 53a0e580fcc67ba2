//! A subscription that replaces another one.
//!
//! RustDDS 0.15.1 gives a new reader the samples that it still stores for the topic, even if the reader is volatile. The new
//! subscription would therefore take messages that the replaced subscription has already taken. Also, ros2-client drains the
//! notifications of RustDDS at each `take`, which costs an allocation and a system call. Delete this module when a new volatile
//! reader gets only messages that arrive after its creation, and the `lib` test a_cycle_allocates_… passes with
//! `ros2_client::Subscription::take`.

use futures::Stream;
use ros2_client::error::{ReadError, ReadResult};
use ros2_client::{MessageInfo, Subscription};
use serde::de::DeserializeOwned;
use std::pin::pin;
use std::sync::atomic::{AtomicI64, Ordering};
use std::task::{Context, Poll, Waker};

/// A subscription of ros2-client that may have replaced another one.
pub(crate) struct ReplaceableSubscription<M> {
    inner: Subscription<M>,
    /// The receive time \[ns\] of the newest message that the replaced subscription has taken; `i64::MIN` if this subscription does
    /// not replace another one. This subscription skips messages up to this time.
    since: i64,
    /// The receive time \[ns\] of the newest message that this subscription has taken; initially `since`.
    newest: AtomicI64,
}

/// A message and its metadata in DDS.
pub(crate) type Sample<M> = (M, MessageInfo);

impl<M: DeserializeOwned + 'static> ReplaceableSubscription<M> {
    pub fn new(inner: Subscription<M>) -> Self {
        Self::since(i64::MIN, inner)
    }

    /// Creates a subscription that reads from `inner` and replaces this one.
    pub fn replaced_by(&self, inner: Subscription<M>) -> Self {
        Self::since(self.newest.load(Ordering::Relaxed), inner)
    }

    fn since(since: i64, inner: Subscription<M>) -> Self {
        Self { inner, since, newest: AtomicI64::new(since) }
    }

    /// Returns the subscription of ros2-client that this one contains.
    pub fn subscription(&self) -> &Subscription<M> {
        &self.inner
    }

    /// Takes the next message of `samples`, if one has arrived. If the message could not be decoded, returns the reason.
    ///
    /// `ros2_client::Subscription::take` drains the notifications of RustDDS first, which costs an allocation and a system call
    /// each time. Polling a stream without a waker costs neither.
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

    /// Returns whether this sample arrived after the newest sample that the replaced subscription has taken. The receive times of a
    /// topic's samples always increase in RustDDS, even if the clock is set back.
    fn is_new(&self, (_, info): &Sample<M>) -> bool {
        let received = info.received_timestamp().map_or(i64::MAX, |time| time.to_nanos());
        self.newest.fetch_max(received, Ordering::Relaxed);
        received > self.since
    }
}

/// Returns the reason why a message could not be decoded. The text of a failed deserialization is used as it is: a thousand such
/// messages may arrive in a cycle, and formatting would cost too much.
fn reason(why: ReadError) -> String {
    match why {
        ReadError::Deserialization { reason } => reason,
        other => other.to_string(),
    }
}
