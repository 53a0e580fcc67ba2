//! The progress of a long task on stderr: a bar on a terminal, otherwise a line every few seconds.

use dq_ros::stderr;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// The time between two lines, if stderr is not a terminal.
const PAUSE: Duration = Duration::from_secs(10);

/// The progress of a task.
pub(super) struct Progress {
    bar: ProgressBar,
    what: &'static str,
    /// The time at which the next line is due; `None` on a terminal, where the bar is shown.
    due: Option<Mutex<Duration>>,
}

impl Progress {
    /// Begins to show the progress of a task with `count` items, which are called `what`.
    pub fn new(what: &'static str, count: u64) -> Self {
        Self::shown(what, count, std::io::stderr().is_terminal())
    }

    fn shown(what: &'static str, count: u64, on_terminal: bool) -> Self {
        let bar = ProgressBar::new(count).with_message(what);
        // The template is constant. If it were invalid, the default template would be used.
        let bar = match ProgressStyle::with_template("{msg} {bar:40} {pos}/{len}, {eta} left") {
            Ok(style) => bar.with_style(style),
            Err(_) => bar,
        };
        Self { bar, what, due: (!on_terminal).then(|| Mutex::new(PAUSE)) }
    }

    /// Adds `count` to the finished items, and shows the progress.
    pub fn add(&self, count: u64) {
        self.bar.inc(count);
        if let Some(line) = self.line(self.bar.elapsed()) {
            stderr::line(line);
        }
    }

    /// Returns the line that is due after the time `elapsed`, if one is due.
    fn line(&self, elapsed: Duration) -> Option<String> {
        let mut due = self.due.as_ref()?.lock().unwrap_or_else(PoisonError::into_inner);
        if elapsed < *due {
            return None;
        }
        *due = elapsed + PAUSE;
        let (done, count) = (self.bar.position(), self.bar.length().unwrap_or_default());
        Some(format!("{}: {done} of {count} after {:.0} s", self.what, elapsed.as_secs_f64()))
    }

    /// Clears the bar.
    pub fn end(self) {
        self.bar.finish_and_clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pipe_gets_a_line_now_and_then_and_a_terminal_none() {
        let lines = |on_terminal: bool| {
            let progress = Progress::shown("runs", 40, on_terminal);
            let line = |seconds: u64| {
                progress.add(1);
                progress.line(Duration::from_secs(seconds))
            };
            [1, 9, 11, 12, 20, 21, 500].into_iter().filter_map(line).collect::<Vec<_>>()
        };
        let expected = ["runs: 3 of 40 after 11 s", "runs: 6 of 40 after 21 s", "runs: 7 of 40 after 500 s"];
        assert_eq!(lines(false), expected);
        assert!(lines(true).is_empty());
    }
}
