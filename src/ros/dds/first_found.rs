//! Records when each publisher was first discovered.
//!
//! RustDDS 0.15.1 lists endpoints without times. Delete this module when RustDDS has these times.

use rustdds::GUID;
use std::collections::HashMap;
use std::time::{Duration, Instant};

/// A publisher that is discovered within this time after the start of this process may be older than the process.
const START: Duration = Duration::from_secs(5);

/// The largest number of publishers that are remembered. These include lost publishers: if one of them is discovered again, its time
/// of discovery does not change.
const MOST: usize = 4096;

/// The time at which each writer was first discovered.
pub(super) struct FirstFound {
    began: Instant,
    found: HashMap<GUID, Instant>,
}

impl Default for FirstFound {
    fn default() -> Self {
        Self { began: Instant::now(), found: HashMap::new() }
    }
}

impl FirstFound {
    /// Notes that `writer` exists.
    pub fn find(&mut self, writer: GUID) {
        if self.found.len() >= MOST && !self.found.contains_key(&writer) {
            // Forget all publishers at once. Each of them then counts as possibly older than this process. This is safe: none of
            // their old messages is taken for a new one.
            self.found.clear();
        }
        self.found.entry(writer).or_insert_with(Instant::now);
    }

    /// Returns the time since `writer` was first discovered; `None` if the writer may be older than this process.
    pub fn elapsed(&self, writer: GUID) -> Option<Duration> {
        let found = self.found.get(&writer)?;
        (found.duration_since(self.began) > START).then(|| found.elapsed())
    }
}
