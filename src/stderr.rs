//! Lines for stderr, written by a thread of its own.
//!
//! A terminal held by ctrl-S and a pipe that nobody reads block a write for as long as they like; a reader that is gone and a
//! full disk fail it. Whoever has something to say queues it here and goes on. Lines that find no room, or that cannot be
//! written, are lost, and their number is written in their place once writing works again.

use std::io::Write;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TryRecvError, TrySendError, sync_channel};
use std::sync::{Arc, LazyLock};
use std::time::{Duration, Instant};

/// Lines that wait at most.
const CAPACITY: usize = 1024;

/// How long [`flush`] waits before it tries again at a full queue.
const RETRY: Duration = Duration::from_millis(5);

/// One thing for the thread.
enum Item {
    /// A line, and how many were lost since the one before.
    Line(String, u64),
    /// Asks for an answer once everything before it is written.
    Flush(SyncSender<()>),
}

/// The end of the queue that everybody has. It never blocks.
pub(crate) struct Queue {
    items: SyncSender<Item>,
    lost: Arc<AtomicU64>,
}

/// The other end.
pub(crate) struct Writer<W> {
    items: Receiver<Item>,
    lost: Arc<AtomicU64>,
    to: W,
}

/// The process's queue; none where the operating system gives no thread.
static QUEUE: LazyLock<Option<Queue>> = LazyLock::new(|| {
    let (queue, writer) = queue(std::io::stderr());
    let thread = std::thread::Builder::new().name("stderr".to_owned());
    thread.spawn(move || writer.run()).ok().map(|_| queue)
});

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

/// A queue of lines, and what writes them to `to` on a thread of its own.
pub(crate) fn queue<W: Write>(to: W) -> (Queue, Writer<W>) {
    let (sender, receiver) = sync_channel(CAPACITY);
    let lost = Arc::new(AtomicU64::new(0));
    (Queue { items: sender, lost: lost.clone() }, Writer { items: receiver, lost, to })
}

impl Queue {
    /// Queues a line. Never blocks, never fails.
    pub fn line(&self, text: String) {
        let lost = self.lost.swap(0, Ordering::Relaxed);
        if self.items.try_send(Item::Line(text, lost)).is_err() {
            self.lost.fetch_add(lost + 1, Ordering::Relaxed);
        }
    }

    /// Waits until all that was queued is written, for `patience` at most; whether it is.
    pub fn flush(&self, patience: Duration) -> bool {
        let end = Instant::now() + patience;
        let (answer, written) = sync_channel(1);
        let mut item = Item::Flush(answer);
        loop {
            match self.items.try_send(item) {
                Ok(()) => return written.recv_timeout(end.saturating_duration_since(Instant::now())).is_ok(),
                Err(TrySendError::Full(back)) if Instant::now() < end => item = back,
                Err(_) => return false,
            }
            std::thread::sleep(RETRY);
        }
    }
}

impl<W: Write> Writer<W> {
    /// Writes until every sender is gone.
    pub fn run(mut self) {
        while let Some(item) = self.next() {
            match item {
                Item::Line(text, lost) => {
                    self.note_lost(lost);
                    self.write(&text, 1);
                }
                // Who has waited too long does not hear it.
                Item::Flush(answer) => drop(answer.try_send(())),
            }
        }
    }

    fn next(&mut self) -> Option<Item> {
        match self.items.try_recv() {
            Err(TryRecvError::Empty) => {
                let lost = self.lost.swap(0, Ordering::Relaxed);
                self.note_lost(lost);
                self.items.recv().ok()
            }
            item => item.ok(),
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
            self.lost.fetch_add(lost, Ordering::Relaxed);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{Error, ErrorKind, Result};
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
        let (queue, writer) = queue(terminal.clone());
        std::thread::spawn(move || writer.run());
        (queue, terminal)
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
