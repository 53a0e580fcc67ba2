//! For how long publishers have been known.
//!
//! RustDDS 0.15.1 lists who is there and keeps no times. This goes when it does.

use rustdds::GUID;
use std::collections::HashMap;
use std::time::{Duration, Instant};

/// Who is found so soon after this process began may have been there before.
const START: Duration = Duration::from_secs(5);

/// So many are remembered, those that are lost too: who is found again is as old as before.
const MOST: usize = 4096;

/// When each writer was found first.
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
    /// Notes that the writer is there.
    pub fn find(&mut self, writer: GUID) {
        if self.found.len() >= MOST && !self.found.contains_key(&writer) {
            // Of those that are forgotten nothing is known, which is the cautious answer.
            self.found.clear();
        }
        self.found.entry(writer).or_insert_with(Instant::now);
    }

    /// For how long the writer has been known; none where it may have been there before this process.
    pub fn elapsed(&self, writer: GUID) -> Option<Duration> {
        let found = self.found.get(&writer)?;
        (found.duration_since(self.began) > START).then(|| found.elapsed())
    }
}
