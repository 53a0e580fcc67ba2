//! Warnings about browsers. Their rate is limited so that nobody can flood the log.

use dq_common::text::cut;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// The shortest time between two warnings.
const INTERVAL: Duration = Duration::from_secs(1);

/// Logs warnings at a limited rate.
pub(super) struct WarningLog {
    warn: Box<dyn Fn(&str) + Send + Sync>,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    last: Option<Instant>,
    unsaid: u64,
}

impl WarningLog {
    pub fn new(warn: Box<dyn Fn(&str) + Send + Sync>) -> Self {
        Self { warn, state: Mutex::default() }
    }

    /// Logs the warning. If another warning was logged less than a second ago, only counts the warning; the next one to be logged
    /// states the count.
    pub fn add(&self, why: &str) {
        let unsaid = {
            // No code panics while it holds the lock.
            let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
            if state.last.is_some_and(|last| last.elapsed() < INTERVAL) {
                state.unsaid += 1;
                return;
            }
            state.last = Some(Instant::now());
            std::mem::take(&mut state.unsaid)
        };
        let more = if unsaid > 0 { format!(" ({unsaid} more before)") } else { String::new() };
        (self.warn)(&format!("{}{more}", cut(why)));
    }
}
