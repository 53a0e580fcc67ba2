//! A place for what another may replace while it is in use.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tokio::sync::Notify;

/// Holds a value that another one may replace.
pub(super) struct Slot<T> {
    value: Mutex<Arc<T>>,
    replaced: Notify,
}

impl<T> Slot<T> {
    pub fn new(value: T) -> Self {
        Self { value: Mutex::new(Arc::new(value)), replaced: Notify::new() }
    }

    /// The value as it is now.
    pub fn get(&self) -> Arc<T> {
        self.lock().clone()
    }

    /// Holds this one from now on.
    pub fn put(&self, value: T) {
        let old = std::mem::replace(&mut *self.lock(), Arc::new(value));
        self.replaced.notify_waiters();
        // Not while the lock is held: that is the cycle's too.
        drop(old);
    }

    /// Waits until another value is put in.
    pub fn replaced(&self) -> impl Future<Output = ()> {
        self.replaced.notified()
    }

    fn lock(&self) -> MutexGuard<'_, Arc<T>> {
        // Nothing panics while it holds the lock.
        self.value.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
