//! Whether RustDDS still works in this process.
//!
//! All that it does is done by two threads, and each of them ends at the first error of its `epoll_wait`, a mere interruption
//! included (RustDDS 0.15.1, `dp_event_loop.rs` and `discovery.rs`: "poll failed"). A process that is stopped and continued meets
//! one: ctrl-Z and `fg`, a debugger, a machine that was suspended. The node would go on, deaf and mute, and report nothing.

use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

/// The names of the two threads, as far as the kernel keeps them (15 bytes).
const NAMES: [&str; 2] = ["RustDDS discove", "RustDDS Partici"];

/// The participants of this process, each with a thread of either name.
static PARTICIPANTS: AtomicUsize = AtomicUsize::new(0);

/// One participant, for as long as this lives.
pub(super) struct Participating(());

impl Participating {
    pub fn new() -> Self {
        PARTICIPANTS.fetch_add(1, Ordering::Relaxed);
        Self(())
    }
}

impl Drop for Participating {
    fn drop(&mut self) {
        PARTICIPANTS.fetch_sub(1, Ordering::Relaxed);
    }
}

/// Waits until a thread of one of this process's participants has ended.
pub async fn network_ended() {
    let mut threads = NetworkThreads::default();
    // A thread has its name a moment after it has begun.
    let mut missed = 0;
    while missed < 2 {
        tokio::time::sleep(Duration::from_millis(100)).await;
        missed = if threads.run() { 0 } else { missed + 1 };
    }
}

/// The threads of this process's participants, by their directories.
#[derive(Default)]
pub struct NetworkThreads(Vec<PathBuf>);

impl NetworkThreads {
    /// Whether all of them run; true too where the operating system does not say.
    ///
    /// Costs little because those that were seen are only looked for: all threads are asked for their names where one is missed.
    pub fn run(&mut self) -> bool {
        let participants = PARTICIPANTS.load(Ordering::Relaxed);
        if self.0.len() == NAMES.len() * participants && self.0.iter().all(|thread| thread.exists()) {
            return true;
        }
        let Ok(tasks) = std::fs::read_dir("/proc/self/task") else { return true };
        let name = |thread: &PathBuf| std::fs::read_to_string(thread.join("comm")).unwrap_or_default();
        let named: Vec<_> =
            tasks.flatten().map(|task| task.path()).map(|thread| (name(&thread), thread)).collect();
        let called = |wanted: &str| {
            let threads = named.iter().filter(|(name, _)| name.trim_end() == wanted);
            threads.map(|(_, thread)| thread.clone()).collect::<Vec<_>>()
        };
        let threads = NAMES.map(called);
        self.0 = threads.concat();
        threads.iter().all(|called| called.len() >= participants)
    }
}
