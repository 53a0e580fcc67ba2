//! The signals that end a command, and the signals that are ignored.

use futures::future::select_all;
use rustix::process;
use std::io;
use std::ops::RangeInclusive;
use std::time::{Duration, Instant};
use tokio::signal::unix::{Signal, SignalKind, signal};

/// The signals that end a command: SIGINT, SIGTERM, SIGQUIT, SIGXCPU (a limit of `ulimit -t`), SIGPWR, and SIGHUP (a closed
/// terminal, a lost connection). SIGHUP is left out if it was ignored when the program started, as under `nohup`.
pub(super) struct Signals {
    ends: Vec<Signal>,
    last: Option<Instant>,
}

/// Signals that nobody sends in order to end a process. By default they end the process without a message, even a servo whose arm
/// moves. One of them is SIGXFSZ. If SIGXFSZ is ignored, a write beyond a limit of `ulimit -f` fails like a write to a full disk.
const IGNORED: [process::Signal; 8] = [
    process::Signal::USR1,
    process::Signal::USR2,
    process::Signal::ALARM,
    process::Signal::VTALARM,
    process::Signal::PROF,
    process::Signal::IO,
    process::Signal::STKFLT,
    process::Signal::XFSZ,
];

/// The real-time signals, which are ignored too. They have no standard meaning.
const REAL_TIME: RangeInclusive<i32> = 34..=64;

/// Ignores the signals that are not meant to end a command, but would end it by default.
///
/// # Errors
/// The operating system's error.
pub(super) fn ignore_others() -> io::Result<()> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_io().build()?;
    let _inside = runtime.enter();
    let mut kinds = IGNORED.map(process::Signal::as_raw).into_iter().chain(REAL_TIME);
    // The handler of a signal stays installed after the `Signal` is dropped.
    kinds.try_for_each(|kind| signal(SignalKind::from_raw(kind)).map(drop))
}

/// Signals that arrive within this time count as one. For example, coreutils `timeout` signals its child twice: first the process,
/// then its process group.
const TOGETHER: Duration = Duration::from_millis(20);

impl Signals {
    /// Catches the signals, so that they do not end the process any more. [`next`](Self::next) returns when one arrives.
    ///
    /// # Errors
    /// The operating system's error.
    pub fn new() -> io::Result<Self> {
        let also = [process::Signal::XCPU, process::Signal::POWER].map(process::Signal::as_raw);
        let kinds = [SignalKind::interrupt(), SignalKind::terminate(), SignalKind::quit()];
        let hangup = (!hangup_is_ignored()).then(SignalKind::hangup);
        let kinds = kinds.into_iter().chain(also.map(SignalKind::from_raw)).chain(hangup);
        Ok(Self { ends: kinds.map(signal).collect::<io::Result<_>>()?, last: None })
    }

    /// Waits for one of the signals. Signals that arrive shortly after the previous one count as the same signal.
    pub async fn next(&mut self) {
        loop {
            self.any().await;
            if self.last.is_none_or(|last| last.elapsed() > TOGETHER) {
                self.last = Some(Instant::now());
                return;
            }
        }
    }

    async fn any(&mut self) {
        select_all(self.ends.iter_mut().map(|signal| Box::pin(signal.recv()))).await;
    }
}

/// Returns whether SIGHUP is ignored. The answer is right only before a handler of SIGHUP is installed.
fn hangup_is_ignored() -> bool {
    std::fs::read_to_string("/proc/self/status").is_ok_and(|status| ignores_hangup(&status))
}

/// Reads the mask `SigIgn` in proc_pid_status(5). Signal 1 is its lowest bit.
fn ignores_hangup(status: &str) -> bool {
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).is_some_and(|mask| mask & 1 == 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mask_of_ignored_signals_is_read() {
        assert!(ignores_hangup("Name:\tx\nSigIgn:\t0000000000001001\nSigCgt:\t0000000000000000\n"));
        assert!(!ignores_hangup("SigIgn:\t0000000000001000\nSigCgt:\t0000000000000001\n"));
        assert!(!ignores_hangup(""));
    }
}
