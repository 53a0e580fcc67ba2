//! Real-time priorities for the cycle's thread and the threads of DDS, as the parameter `realtime_priority` requests.

use rustix::mm::{MlockAllFlags, mlockall};
use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
use std::io::Error as SystemError;
use thiserror::Error;
use thread_priority::{
    RealtimeThreadSchedulePolicy, ThreadPriority, ThreadSchedulePolicy, set_thread_priority_and_policy,
    thread_native_id,
};

/// The reason why the system refuses real-time scheduling.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RealtimeError {
    /// The priority was refused.
    #[error(
        "realtime_priority {priority}: the system does not allow SCHED_FIFO ({why}): it takes an RLIMIT_RTPRIO of {priority} or more \
         (`ulimit -r`, rtprio in /etc/security/limits.conf, LimitRTPRIO= of a systemd unit, --ulimit rtprio= of a container) or CAP_SYS_NICE; \
         0 does without"
    )]
    Priority {
        /// The requested priority.
        priority: u8,
        /// The system's error.
        why: SystemError,
    },
    /// Locking memory was refused.
    #[error(
        "realtime_priority {priority}: the system does not allow to lock memory ({why}): it takes an unlimited RLIMIT_MEMLOCK (`ulimit -l`, \
         memlock in /etc/security/limits.conf, LimitMEMLOCK= of a systemd unit, --ulimit memlock=-1 of a container) or CAP_IPC_LOCK; \
         0 does without"
    )]
    Memory {
        /// The requested priority.
        priority: u8,
        /// The system's error.
        why: String,
    },
}

/// Gives the calling thread SCHED_FIFO with `priority`, and locks the process's memory. A priority of 0 changes nothing.
///
/// # Errors
/// [`RealtimeError`] if the system does not allow it.
pub(super) fn enter(priority: u8) -> Result<(), RealtimeError> {
    if priority == 0 {
        return Ok(());
    }
    schedule(priority, priority)?;
    lock_memory().map_err(|why| RealtimeError::Memory { priority, why })
}

/// Calls `make`, which starts the threads of DDS, and gives these threads SCHED_FIFO. `priority` is the priority of the cycle. The
/// threads of DDS get `priority - 1`, but at least 1. If `priority` is 0, they keep the ordinary priority.
///
/// With an ordinary priority, the threads of DDS could delay the messages of a cycle that is never late. Threads inherit the
/// priority of the thread that starts them, so a temporary thread with this priority calls `make`.
///
/// # Errors
/// [`RealtimeError`] if the system does not allow the priority. Then `make` is not called.
pub fn below<R: Send>(priority: u8, make: impl FnOnce() -> R + Send) -> Result<R, RealtimeError> {
    if priority == 0 {
        return Ok(make());
    }
    let made = std::thread::scope(|scope| {
        scope.spawn(|| schedule(priority.saturating_sub(1).max(1), priority).map(|()| make())).join()
    });
    made.unwrap_or_else(|panic| std::panic::resume_unwind(panic))
}

/// Gives the calling thread SCHED_FIFO with priority `own`. `asked` is the value of the parameter `realtime_priority`, for errors.
fn schedule(own: u8, asked: u8) -> Result<(), RealtimeError> {
    let refused = |why| RealtimeError::Priority { priority: asked, why };
    let value = ThreadPriority::try_from(own).map_err(|why| refused(SystemError::other(why)))?;
    let fifo = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
    set_thread_priority_and_policy(thread_native_id(), value, fifo).map_err(|why| match why {
        thread_priority::Error::OS(code) => refused(SystemError::from_raw_os_error(code)),
        other => refused(SystemError::other(format!("{other:?}"))),
    })
}

/// Locks the present and future memory of the process.
///
/// With a finite limit on locked memory, the process would fail later, when it allocates more. So the limit must be unlimited, or
/// must not apply to this process.
fn lock_memory() -> Result<(), String> {
    let all = || mlockall(MlockAllFlags::CURRENT | MlockAllFlags::FUTURE).map_err(|why| why.to_string());
    let limit = getrlimit(Resource::Memlock);
    let Some(bytes) = limit.current else { return all() };
    // Check whether the limit applies to this process: if the process can lock memory with a limit of 0, the limit does not apply.
    // Having the capability CAP_IPC_LOCK does not prove this, because it may be valid only in a user namespace.
    let nothing = Rlimit { current: Some(0), maximum: limit.maximum };
    setrlimit(Resource::Memlock, nothing).map_err(|why| why.to_string())?;
    let locked = all();
    setrlimit(Resource::Memlock, limit).map_err(|why| why.to_string())?;
    locked.map_err(|why| format!("{why}; RLIMIT_MEMLOCK is {} kB", bytes / 1024))
}
