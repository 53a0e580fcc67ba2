//! Whether DDS still serves this process.
//!
//! All that RustDDS does is done by two threads, and each of them ends at the first error of its `epoll_wait`, a mere interruption
//! included (RustDDS 0.15.1, `dp_event_loop.rs` and `discovery.rs`: "poll failed"). A process that is stopped and continued meets
//! one: ctrl-Z and `fg`, a debugger, a machine that was suspended. The node would go on, hear and send nothing, and report nothing.
//!
//! Nor does RustDDS hear a participant that was lost and is back (`peer_recovery`). Either way the process is to be started
//! anew. This goes when a node that was stopped and continued goes on: test `faults` a_servo_frozen_in_motion_… then has
//! nothing to end.

use std::path::PathBuf;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;
use thiserror::Error;

/// The names of the two threads, as far as the kernel keeps them (15 bytes).
const NAMES: [&str; 2] = ["RustDDS discove", "RustDDS Partici"];

/// The participants of this process, each with a thread of either name.
static PARTICIPANTS: AtomicUsize = AtomicUsize::new(0);

/// Who is there and is heard no more, as soon as there is somebody.
static DEAF_TO: OnceLock<String> = OnceLock::new();

/// Why a process has to be started anew to be heard, or to hear.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum NetworkEnd {
    /// Its threads have ended.
    #[error(
        "DDS has ended in this process, as it does when the process was stopped (ctrl-Z, a debugger, a suspended machine)"
    )]
    Stopped,
    /// A participant that was heard was lost and is there again.
    #[error(
        "{0} was not heard for longer than its lease and is there again, but DDS cannot hear it any more in this process"
    )]
    Deaf(String),
}

/// One participant, for as long as this lives.
pub(crate) struct Participating(());

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

/// This process hears `peer` no more, which is there.
pub(crate) fn deaf_to(peer: String) {
    // The first one is reason enough.
    let _ = DEAF_TO.set(peer);
}

/// Looks whether DDS still serves this process: by its participants' threads, which it knows by their directories.
#[derive(Default)]
pub struct NetworkWatch(Vec<PathBuf>);

impl NetworkWatch {
    /// Looks now. It is well too where the operating system does not say.
    ///
    /// # Errors
    /// [`NetworkEnd`].
    pub fn check(&mut self) -> Result<(), NetworkEnd> {
        if let Some(peer) = DEAF_TO.get() {
            return Err(NetworkEnd::Deaf(peer.clone()));
        }
        if self.threads_run() { Ok(()) } else { Err(NetworkEnd::Stopped) }
    }

    /// Waits for the end.
    pub async fn ended() -> NetworkEnd {
        let mut watch = Self::default();
        // A thread has its name a moment after it has begun.
        let mut missed = 0;
        loop {
            tokio::time::sleep(Duration::from_millis(100)).await;
            match watch.check() {
                Ok(()) => missed = 0,
                Err(end) if missed > 0 => return end,
                Err(_) => missed += 1,
            }
        }
    }

    /// Costs little because those that were seen are only looked for: all threads are asked for their names where one is missed.
    fn threads_run(&mut self) -> bool {
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
