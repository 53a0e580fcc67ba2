//! A thread that runs a cycle at a fixed rate, with absolute deadlines.

use super::NodeError;
use super::realtime;
use rustix::thread::{ClockId, clock_nanosleep_absolute, set_current_timer_slack};
use rustix::time::{Timespec, clock_gettime};
use std::any::Any;
use std::num::NonZeroU64;
use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::sync_channel;
use std::thread::JoinHandle;
use std::time::Duration;

/// One wake-up of the thread.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tick {
    /// When the thread woke up, on the monotonic clock.
    pub now: Duration,
    /// The delay of the wake-up after its deadline.
    pub lateness: Duration,
    /// The number of deadlines skipped since the previous cycle. The thread does not catch up on skipped cycles.
    pub missed: u64,
    /// The time that the previous cycle took; `None` in the first cycle.
    pub worked: Option<Duration>,
}

/// The period of a cycle, and the priority of its thread.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Schedule {
    pub period: Duration,
    /// The SCHED_FIFO priority; 0 for an ordinary thread.
    pub realtime_priority: u8,
}

/// Runs `body` on a new thread, as often as `schedule` says, until `body` breaks. Then drops `body` and the values that it owns.
/// Finally calls `on_end` with the value of the break, or with the message of a panic.
///
/// # Errors
/// [`NodeError::Thread`], and [`NodeError::Realtime`] if the system does not allow the priority. After an error, neither `body` nor
/// `on_end` is called.
pub(super) fn spawn<E>(
    name: &str,
    schedule: Schedule,
    body: impl FnMut(Tick) -> ControlFlow<E> + Send + 'static,
    on_end: impl FnOnce(Result<E, String>) + Send + 'static,
) -> Result<JoinHandle<()>, NodeError> {
    let (sender, entered) = sync_channel(1);
    let thread = std::thread::Builder::new().name(name.to_owned()).spawn(move || {
        // Without this call, the kernel may wake the thread up to 50 µs late, to wake several threads at once. If the call fails,
        // nothing else changes.
        let _ = set_current_timer_slack(NonZeroU64::new(1));
        let allowed = realtime::enter(schedule.realtime_priority);
        let runs = allowed.is_ok();
        // Sending does not fail, because the receiver waits for this message.
        let _ = sender.send(allowed);
        if runs {
            let ended = catch_unwind(AssertUnwindSafe(move || run(schedule.period, body)));
            on_end(ended.map_err(|panic| message(&*panic).to_owned()));
        }
    })?;
    entered.recv().unwrap_or(Ok(()))?;
    Ok(thread)
}

/// A cycle on its own thread, which ends when this value is dropped.
pub(super) struct CycleThread {
    ended: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl CycleThread {
    /// Runs `body` on a new thread, as often as `schedule` says, until this value is dropped.
    ///
    /// # Errors
    /// The errors of [`spawn`].
    pub fn start(
        name: &str,
        schedule: Schedule,
        mut body: impl FnMut(Tick) + Send + 'static,
    ) -> Result<Self, NodeError> {
        let ended = Arc::new(AtomicBool::new(false));
        let asked = ended.clone();
        let body = move |tick| {
            if asked.load(Ordering::Relaxed) {
                return ControlFlow::Break(());
            }
            body(tick);
            ControlFlow::Continue(())
        };
        Ok(Self { ended, thread: Some(spawn(name, schedule, body, drop)?) })
    }

    /// Returns whether the cycle is running. It runs until this value is dropped, unless it panics.
    pub fn is_running(&self) -> bool {
        self.thread.as_ref().is_some_and(|thread| !thread.is_finished())
    }
}

impl Drop for CycleThread {
    fn drop(&mut self) {
        self.ended.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn run<E>(period: Duration, mut body: impl FnMut(Tick) -> ControlFlow<E>) -> E {
    let mut deadline = now();
    let (mut missed, mut worked) = (0, None);
    loop {
        sleep_until(deadline);
        let now = now();
        let lateness = now.saturating_sub(deadline);
        if let ControlFlow::Break(end) = body(Tick { now, lateness, missed, worked }) {
            return end;
        }
        let done = self::now();
        worked = Some(done.saturating_sub(now));
        (deadline, missed) = next_deadline(deadline, done, period);
    }
}

fn message(panic: &(dyn Any + Send)) -> &str {
    let text = panic.downcast_ref::<&str>().copied();
    text.or_else(|| panic.downcast_ref::<String>().map(String::as_str)).unwrap_or("a panic")
}

/// Returns the next deadline and the number of deadlines that were skipped. The next deadline is the first that is not before
/// `now`. It is one or more whole periods after `deadline`.
fn next_deadline(deadline: Duration, now: Duration, period: Duration) -> (Duration, u64) {
    let next = deadline + period;
    let late = now.saturating_sub(next);
    let missed = u64::try_from(late.as_nanos().div_ceil(period.as_nanos().max(1))).unwrap_or(u64::MAX);
    let skip = period * u32::try_from(missed).unwrap_or(u32::MAX);
    (next + skip, missed)
}

fn now() -> Duration {
    let time = clock_gettime(rustix::time::ClockId::Monotonic);
    Duration::new(time.tv_sec.unsigned_abs(), u32::try_from(time.tv_nsec).unwrap_or(0))
}

fn sleep_until(deadline: Duration) {
    let seconds = i64::try_from(deadline.as_secs()).unwrap_or(i64::MAX);
    let request = Timespec { tv_sec: seconds, tv_nsec: i64::from(deadline.subsec_nanos()) };
    // A signal ends the sleep early; the deadline does not change.
    while let Err(rustix::io::Errno::INTR) = clock_nanosleep_absolute(ClockId::Monotonic, &request) {}
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::TryRecvError;

    const MS: Duration = Duration::from_millis(1);
    const EACH_MS: Schedule = Schedule { period: MS, realtime_priority: 0 };

    #[test]
    fn a_panic_is_reported_before_on_end_is_called() {
        let (sender, receiver) = std::sync::mpsc::channel();
        let mut ticks = 0;
        let body = move |_| {
            ticks += 1;
            assert!(ticks < 3, "in tick {ticks}");
            ControlFlow::<()>::Continue(())
        };
        spawn("test", EACH_MS, body, move |ended| sender.send(ended).unwrap()).unwrap().join().unwrap();
        assert_eq!(receiver.recv(), Ok(Err("in tick 3".to_owned())));
    }

    #[test]
    fn a_cycle_ends_with_its_owner_or_by_its_panic() {
        let (sender, receiver) = std::sync::mpsc::channel();
        let cycle = CycleThread::start("test", EACH_MS, move |_| sender.send(()).unwrap()).unwrap();
        receiver.recv().unwrap();
        assert!(cycle.is_running());
        drop(cycle);
        while receiver.try_recv().is_ok() {}
        assert_eq!(receiver.try_recv(), Err(TryRecvError::Disconnected), "what the cycle owned is gone");

        let cycle = CycleThread::start("test", EACH_MS, |_| panic!("at once")).unwrap();
        while cycle.is_running() {
            std::thread::sleep(MS);
        }
    }

    #[test]
    fn a_cycle_without_its_priority_does_not_run() {
        let (sender, receiver) = std::sync::mpsc::channel();
        let words = sender.clone();
        let body = move |_| {
            sender.send("a tick").unwrap();
            ControlFlow::Break(())
        };
        // No system has this priority.
        let schedule = Schedule { period: MS, realtime_priority: 100 };
        let refused = spawn("test", schedule, body, move |_| words.send("last words").unwrap());
        assert!(matches!(refused, Err(NodeError::Realtime(_))));
        assert_eq!(receiver.recv(), Err(std::sync::mpsc::RecvError));
    }

    #[test]
    fn the_deadlines_that_a_slow_tick_has_missed_are_not_made_up_for() {
        let (sender, receiver) = std::sync::mpsc::channel();
        let mut ticks = Vec::new();
        let body = move |tick: Tick| {
            if ticks.len() == 2 {
                std::thread::sleep(20 * MS);
            }
            ticks.push((tick, now()));
            if ticks.len() < 6 {
                ControlFlow::Continue(())
            } else {
                ControlFlow::Break(std::mem::take(&mut ticks))
            }
        };
        spawn("test", EACH_MS, body, move |ended| sender.send(ended).unwrap()).unwrap().join().unwrap();
        let ticks = receiver.recv().unwrap().unwrap();
        let deadline = |tick: &Tick| tick.now - tick.lateness;
        for ((one, ended), (next, _)) in ticks.iter().zip(&ticks[1..]) {
            assert!(deadline(next) >= *ended, "{next:?} was due before {ended:?}");
            let passed = u32::try_from(next.missed).unwrap() + 1;
            assert_eq!(deadline(next) - deadline(one), passed * MS, "{next:?} after {one:?}");
        }
        assert!(ticks[3].0.missed >= 19, "{:?}", ticks[3]);
    }

    #[test]
    fn the_kernel_does_not_wake_it_late_to_wake_others_with_it() {
        let body = |_| ControlFlow::Break(rustix::thread::current_timer_slack().unwrap());
        let (sender, receiver) = std::sync::mpsc::channel();
        spawn("test", EACH_MS, body, move |ended| sender.send(ended).unwrap()).unwrap().join().unwrap();
        assert_eq!(receiver.recv(), Ok(Ok(1)), "[ns]");
    }

    #[test]
    fn deadlines_stay_on_their_grid_and_missed_ones_are_counted() {
        assert_eq!(next_deadline(10 * MS, 10 * MS, 2 * MS), (12 * MS, 0));
        assert_eq!(next_deadline(10 * MS, 12 * MS, 2 * MS), (12 * MS, 0));
        assert_eq!(next_deadline(10 * MS, 13 * MS, 2 * MS), (14 * MS, 1));
        assert_eq!(next_deadline(10 * MS, 17 * MS, 2 * MS), (18 * MS, 3));
    }
}
