//! Real time for a cycle's thread and for those of DDS, as the parameter `realtime_priority` asks for it.

use rustix::mm::{MlockAllFlags, mlockall};
use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
use std::io::Error as SystemError;
use thiserror::Error;
use thread_priority::{
    RealtimeThreadSchedulePolicy, ThreadPriority, ThreadSchedulePolicy, set_thread_priority_and_policy,
    thread_native_id,
};

/// Why the system does not let a cycle have it.
#[derive(Debug, Error)]
pub enum RealtimeError {
    /// The priority.
    #[error(
        "realtime_priority {priority}: the system does not allow SCHED_FIFO ({why}): it takes an RLIMIT_RTPRIO of {priority} or more \
         (`ulimit -r`, rtprio in /etc/security/limits.conf, LimitRTPRIO= of a systemd unit, --ulimit rtprio= of a container) or CAP_SYS_NICE; \
         0 does without"
    )]
    Priority {
        /// What was asked for.
        priority: u8,
        /// The system's error.
        why: SystemError,
    },
    /// The memory.
    #[error(
        "realtime_priority {priority}: the system does not allow to lock memory ({why}): it takes an unlimited RLIMIT_MEMLOCK (`ulimit -l`, \
         memlock in /etc/security/limits.conf, LimitMEMLOCK= of a systemd unit, --ulimit memlock=-1 of a container) or CAP_IPC_LOCK; \
         0 does without"
    )]
    Memory {
        /// What was asked for.
        priority: u8,
        /// What the system says.
        why: String,
    },
}

/// Gives the thread that calls it SCHED_FIFO with `priority`, and locks the process's memory; 0 leaves all as it is.
///
/// # Errors
/// [`RealtimeError`] where the system does not allow it.
pub(super) fn enter(priority: u8) -> Result<(), RealtimeError> {
    if priority == 0 {
        return Ok(());
    }
    schedule(priority, priority)?;
    lock_memory().map_err(|why| RealtimeError::Memory { priority, why })
}

/// What `make` makes, which starts threads: they have SCHED_FIFO below the cycle's `priority` by one (1 at least), as threads inherit it
/// from those that start them. A cycle that is never late would else wait for threads of DDS that are. 0 leaves all as it is.
///
/// # Errors
/// [`RealtimeError`] where the system does not allow it: then nothing is made.
pub fn below<R: Send>(priority: u8, make: impl FnOnce() -> R + Send) -> Result<R, RealtimeError> {
    if priority == 0 {
        return Ok(make());
    }
    let made = std::thread::scope(|scope| {
        scope.spawn(|| schedule(priority.saturating_sub(1).max(1), priority).map(|()| make())).join()
    });
    made.unwrap_or_else(|panic| std::panic::resume_unwind(panic))
}

/// Gives the thread that calls it SCHED_FIFO with this priority, where `asked` is the one that was asked for.
fn schedule(own: u8, asked: u8) -> Result<(), RealtimeError> {
    let refused = |why| RealtimeError::Priority { priority: asked, why };
    let value = ThreadPriority::try_from(own).map_err(|why| refused(SystemError::other(why)))?;
    let fifo = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
    set_thread_priority_and_policy(thread_native_id(), value, fifo).map_err(|why| match why {
        thread_priority::Error::OS(code) => refused(SystemError::from_raw_os_error(code)),
        other => refused(SystemError::other(format!("{other:?}"))),
    })
}

/// Locks what memory the process has, and what it will have. A limit that suffices now would end the process later, when it allocates
/// more: so there must be none, or the process must be above it.
fn lock_memory() -> Result<(), String> {
    let all = || mlockall(MlockAllFlags::CURRENT | MlockAllFlags::FUTURE).map_err(|why| why.to_string());
    let limit = getrlimit(Resource::Memlock);
    let Some(bytes) = limit.current else { return all() };
    // Who can lock memory where nobody may is above the limit; to have the capability says less, in a namespace of users.
    let nothing = Rlimit { current: Some(0), maximum: limit.maximum };
    setrlimit(Resource::Memlock, nothing).map_err(|why| why.to_string())?;
    let locked = all();
    setrlimit(Resource::Memlock, limit).map_err(|why| why.to_string())?;
    locked.map_err(|why| format!("{why}; RLIMIT_MEMLOCK is {} kB", bytes / 1024))
}
