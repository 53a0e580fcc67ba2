//! Records for how long publishers have been known.
//!
//! RustDDS 0.15.1 lists endpoints without times. Delete this module when RustDDS has these times.

use rustdds::GUID;
use std::collections::HashMap;
use std::time::{Duration, Instant};

/// A publisher that is discovered within this time after the start of the process may have existed before the process.
const START: Duration = Duration::from_secs(5);

/// The number of publishers that are remembered, including publishers that were lost. A lost publisher that comes back keeps its
/// age.
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
            // The forgotten writers then count as writers that may have existed before this process, which is the safe answer.
            self.found.clear();
        }
        self.found.entry(writer).or_insert_with(Instant::now);
    }

    /// Returns for how long `writer` has been known; `None` if the writer may have existed before this process.
    pub fn elapsed(&self, writer: GUID) -> Option<Duration> {
        let found = self.found.get(&writer)?;
        (found.duration_since(self.began) > START).then(|| found.elapsed())
    }
}
