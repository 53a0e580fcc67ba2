//! Lines for stderr, written by a thread of its own.
//!
//! A terminal held by ctrl-S and a pipe that nobody reads block a write for as long as they like; a reader that is gone and a
//! full disk fail it. Whoever has something to say queues it here and goes on. Lines that find no room, or that cannot be
//! written, are lost, and their number is written in their place once writing works again.

use std::io::{Result, Write};
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering::SeqCst};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, LazyLock};
use std::time::{Duration, Instant};

/// Lines that wait at most.
const CAPACITY: usize = 1024;

/// How long [`flush`] waits before it looks again.
const RETRY: Duration = Duration::from_millis(5);

/// The end of the queue that everybody has. It never blocks.
pub(crate) struct Queue {
    lines: SyncSender<Line>,
    counts: Arc<Counts>,
}

struct Line {
    text: String,
    /// How many were lost since the one before.
    lost: u64,
}

#[derive(Default)]
struct Counts {
    /// Lines that are queued and not yet written.
    waiting: AtomicUsize,
    /// Lines that were lost since the last line that counts them.
    lost: AtomicU64,
}

/// The process's queue; none where the operating system gives no thread.
static QUEUE: LazyLock<Option<Queue>> = LazyLock::new(|| Queue::start("stderr", std::io::stderr()).ok());

/// Queues a line for stderr. Never blocks, never fails.
pub fn line(text: impl Into<String>) {
    match &*QUEUE {
        Some(queue) => queue.line(text.into()),
        // Where there is not even this thread, the line is the program's last.
        None => drop(writeln!(std::io::stderr(), "{}", text.into())),
    }
}

/// Waits until all that was queued is written, for `patience` at most; whether it is.
pub fn flush(patience: Duration) -> bool {
    QUEUE.as_ref().is_none_or(|queue| queue.flush(patience))
}

impl Queue {
    /// A queue of lines, and the thread of that name that writes them.
    ///
    /// # Errors
    /// The operating system's, where it gives no thread.
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

    /// Waits until nothing is queued any more, for `patience` at most; whether it is so.
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
    /// Writes until the queue is gone.
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

    /// Writes a line; one that cannot be written counts as `lost` lines.
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

    /// A terminal: held, broken, or neither.
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
    fn a_held_terminal_holds_nobody_and_what_is_lost_is_counted_in_its_place() {
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
        // In two places where the writer begins only once the queue is full.
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
