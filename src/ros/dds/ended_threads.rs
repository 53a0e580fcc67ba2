//! Detects that DDS no longer works in this process.
//!
//! RustDDS runs on two threads, and each of them ends at the first error of its `epoll_wait`, even at an interruption (RustDDS
//! 0.15.1, `dp_event_loop.rs` and `discovery.rs`: "poll failed"). A process gets such an error if it is stopped and continued: by
//! ctrl-Z and `fg`, by a debugger, or because the machine was suspended. Without this module the node would continue without
//! receiving, sending or reporting anything.
//!
//! RustDDS also ignores a participant that was lost and is back (`peer_recovery`). After either failure the process must be
//! restarted. Delete this module when a node that was stopped and continued works again. Then the servo in test `faults`
//! a_servo_frozen_in_motion_… no longer ends.

use std::net::Ipv4Addr;
use std::path::PathBuf;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;
use thiserror::Error;

/// The names of RustDDS's two threads, shortened to the 15 bytes that the kernel stores.
const NAMES: [&str; 2] = ["RustDDS discove", "RustDDS Partici"];

/// The number of participants in this process. Each has one thread of each name.
static PARTICIPANTS: AtomicUsize = AtomicUsize::new(0);

/// The reason why another module of this crate has declared that DDS no longer works.
static END: OnceLock<NetworkEnd> = OnceLock::new();

/// The reason why a process must be restarted to send or receive again.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum NetworkEnd {
    /// The threads of DDS have ended.
    #[error(
        "DDS has ended in this process, as it does when the process was stopped (ctrl-Z, a debugger, a suspended machine)"
    )]
    Stopped,
    /// A participant was lost and is present again.
    #[error(
        "{0} was not heard for longer than its lease and is back, but DDS in this process can no longer receive from it"
    )]
    Deaf(String),
    /// A participant was lost, and this process could not notice its return.
    #[error(
        "{0} was not heard for longer than its lease, and with ROS_STATIC_PEERS DDS in this process would not hear its return"
    )]
    Lost(String),
    /// This host has an address that the participant does not use, for example because the process was started before the network.
    #[error("this host has the new address {0}, by which DDS in this process meets nobody")]
    NewAddress(Ipv4Addr),
}

/// The first address that this host got after the participant was created.
static NEW_ADDRESS: OnceLock<Ipv4Addr> = OnceLock::new();

/// Increases [`PARTICIPANTS`] by one while this value exists.
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

/// Notes an address of this host that the participant does not use.
pub(crate) fn note_new_address(address: Ipv4Addr) {
    let _ = NEW_ADDRESS.set(address);
}

/// Notes a reason why this process must be restarted.
pub(crate) fn end(why: NetworkEnd) {
    // One reason is sufficient.
    let _ = END.set(why);
}

/// Checks whether DDS still works in this process. Contains the `/proc` directories of the DDS threads: a directory disappears when
/// its thread ends.
#[derive(Default)]
pub struct NetworkWatch(Vec<PathBuf>);

impl NetworkWatch {
    /// Checks once whether DDS works. Also returns `Ok` if the operating system does not list the threads of a process.
    ///
    /// # Errors
    /// [`NetworkEnd`] if DDS does not work any more.
    pub fn check(&mut self) -> Result<(), NetworkEnd> {
        if let Some(end) = END.get() {
            return Err(end.clone());
        }
        if self.threads_run() { Ok(()) } else { Err(NetworkEnd::Stopped) }
    }

    /// Checks whether this process uses every address of this host. A process that still waits for its robot should end if this
    /// check fails. A process that receives from its robot can continue without the new address.
    ///
    /// # Errors
    /// [`NetworkEnd::NewAddress`] if an address is not used.
    pub fn check_addresses(&self) -> Result<(), NetworkEnd> {
        NEW_ADDRESS.get().map_or(Ok(()), |address| Err(NetworkEnd::NewAddress(*address)))
    }

    /// Waits until DDS does not work any more, and returns the reason.
    pub async fn ended() -> NetworkEnd {
        let mut watch = Self::default();
        // A single failed check is ignored, because a new thread gets its name shortly after its start.
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

    /// Returns whether all DDS threads exist. The check is cheap: it reads the names of all threads only if a known DDS thread is
    /// missing, or if the number of participants has changed.
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
