//! Writes lines to stderr on its own thread.
//!
//! A terminal stopped by ctrl-S, or a pipe that nobody reads, can block a write forever. A closed pipe or a full disk makes the
//! write fail. Therefore callers only queue their lines, which never blocks. Lines that do not fit into the queue or cannot be
//! written are lost. Once writing works again, one line gives the number of lost lines.

use std::io::{Result, Write};
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering::SeqCst};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, LazyLock};
use std::time::{Duration, Instant};

/// The largest number of lines in a queue.
const CAPACITY: usize = 1024;

/// How often [`flush`] checks the queue.
const RETRY: Duration = Duration::from_millis(5);

/// The sending end of a queue of lines, which another thread writes.
pub(crate) struct Queue {
    lines: SyncSender<Line>,
    counts: Arc<Counts>,
}

struct Line {
    text: String,
    /// The number of lines that were lost between the previous line and this one.
    lost: u64,
}

#[derive(Default)]
struct Counts {
    /// The number of lines that are queued and not yet written.
    waiting: AtomicUsize,
    /// The number of lost lines that were not yet reported.
    lost: AtomicU64,
}

/// The queue for stderr of this process; `None` if the operating system creates no thread.
static QUEUE: LazyLock<Option<Queue>> = LazyLock::new(|| Queue::start("stderr", std::io::stderr()).ok());

/// Queues a line for stderr. Never blocks, never fails.
pub fn line(text: impl Into<String>) {
    match &*QUEUE {
        Some(queue) => queue.line(text.into()),
        // Without its thread there is no queue, so this write may block. The line is probably the program's last.
        None => drop(writeln!(std::io::stderr(), "{}", text.into())),
    }
}

/// Waits up to `patience` until all queued lines are written. Returns whether all are written.
pub fn flush(patience: Duration) -> bool {
    QUEUE.as_ref().is_none_or(|queue| queue.flush(patience))
}

impl Queue {
    /// Creates a queue of lines, and the thread called `name` that writes the lines to `to`.
    ///
    /// # Errors
    /// The operating system's error if it creates no thread.
    pub fn start(name: &str, to: impl Write + Send + 'static) -> Result<Self> {
        let (sender, lines) = sync_channel(CAPACITY);
        let counts = Arc::new(Counts::default());
        let writer = Writer { counts: counts.clone(), to };
        std::thread::Builder::new().name(name.to_owned()).spawn(move || writer.run(lines))?;
        Ok(Self { lines: sender, counts })
    }

    /// Queues a line. Never blocks, never fails.
    pub fn line(&self, text: String) {
        let Counts { waiting, lost } = &*self.counts;
        let before = lost.swap(0, SeqCst);
        waiting.fetch_add(1, SeqCst);
        if self.lines.try_send(Line { text, lost: before }).is_err() {
            waiting.fetch_sub(1, SeqCst);
            lost.fetch_add(before + 1, SeqCst);
        }
    }

    /// Waits up to `patience` until the queue is empty. Returns whether it is empty.
    pub fn flush(&self, patience: Duration) -> bool {
        let end = Instant::now() + patience;
        while self.counts.waiting.load(SeqCst) > 0 {
            if Instant::now() >= end {
                return false;
            }
            std::thread::sleep(RETRY);
        }
        true
    }
}

struct Writer<W> {
    counts: Arc<Counts>,
    to: W,
}

impl<W: Write> Writer<W> {
    /// Writes lines until the queue is closed.
    fn run(mut self, lines: Receiver<Line>) {
        for Line { text, lost } in lines {
            self.note_lost(lost);
            self.write(&text, 1);
            if self.counts.waiting.load(SeqCst) == 1 {
                let lost = self.counts.lost.swap(0, SeqCst);
                self.note_lost(lost);
            }
            self.counts.waiting.fetch_sub(1, SeqCst);
        }
    }

    fn note_lost(&mut self, lost: u64) {
        if lost > 0 {
            self.write(&format!("... {lost} lines lost"), lost);
        }
    }

    /// Writes a line. If writing fails, adds `lost` to the number of lost lines.
    fn write(&mut self, line: &str, lost: u64) {
        if self.to.write_all(format!("{line}\n").as_bytes()).is_err() {
            self.counts.lost.fetch_add(lost, SeqCst);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{Error, ErrorKind};
    use std::sync::{Mutex, MutexGuard};

    /// A fake terminal that works, is stopped, or is broken.
    #[derive(Clone, Default)]
    struct Terminal {
        text: Arc<Mutex<String>>,
        broken: Arc<Mutex<bool>>,
    }

    impl Terminal {
        fn hold(&self) -> MutexGuard<'_, String> {
            self.text.lock().unwrap()
        }
    }

    impl Write for Terminal {
        fn write(&mut self, bytes: &[u8]) -> Result<usize> {
            if *self.broken.lock().unwrap() {
                return Err(Error::from(ErrorKind::BrokenPipe));
            }
            self.hold().push_str(std::str::from_utf8(bytes).unwrap());
            Ok(bytes.len())
        }

        fn flush(&mut self) -> Result<()> {
            Ok(())
        }
    }

    const SOON: Duration = Duration::from_secs(10);

    fn start() -> (Queue, Terminal) {
        let terminal = Terminal::default();
        (Queue::start("writer", terminal.clone()).unwrap(), terminal)
    }

    #[test]
    fn lines_come_in_order() {
        let (queue, terminal) = start();
        ["a", "b", "c"].iter().for_each(|text| queue.line((*text).to_owned()));
        assert!(queue.flush(SOON));
        assert_eq!(*terminal.hold(), "a\nb\nc\n");
    }

    #[test]
    fn a_blocked_terminal_delays_no_thread_and_lost_lines_are_counted() {
        let (queue, terminal) = start();
        let held = terminal.hold();
        (0..2 * CAPACITY).for_each(|number| queue.line(number.to_string()));
        assert!(!queue.flush(Duration::from_millis(20)));
        drop(held);
        assert!(queue.flush(SOON));
        queue.line("after".to_owned());
        assert!(queue.flush(SOON));
        let text = terminal.hold().clone();
        let lines: Vec<_> = text.lines().collect();
        // If the writer takes its first line only when the queue is full, the lost lines are reported in two places.
        let lost = lines.iter().filter_map(|line| line.strip_prefix("... ")?.strip_suffix(" lines lost"));
        let lost: usize = lost.map(|count| count.parse::<usize>().unwrap()).sum();
        let written = lines.iter().filter(|line| line.parse::<usize>().is_ok()).count();
        assert!(lost > 0);
        assert_eq!(written + lost, 2 * CAPACITY);
        assert_eq!(lines[..3], ["0", "1", "2"]);
        assert_eq!(lines.last(), Some(&"after"));
    }

    #[test]
    fn lines_that_cannot_be_written_are_counted_once_they_can() {
        let (queue, terminal) = start();
        *terminal.broken.lock().unwrap() = true;
        ["a", "b", "c"].iter().for_each(|text| queue.line((*text).to_owned()));
        assert!(queue.flush(SOON), "errors are no reason to wait");
        *terminal.broken.lock().unwrap() = false;
        queue.line("d".to_owned());
        assert!(queue.flush(SOON));
        assert_eq!(*terminal.hold(), "... 3 lines lost\nd\n");
    }
}
