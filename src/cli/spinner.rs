//! A progress line on the terminal. Its own thread draws the line, so that a terminal stopped by ctrl-S does not block the command.

use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::time::Duration;

/// The longest time that dropping a [`Spinner`] waits until the spinner's thread has cleared the line.
const LAST_DRAWING: Duration = Duration::from_millis(200);

/// A progress line. It is cleared when this value is dropped.
pub(super) struct Spinner {
    texts: Option<SyncSender<String>>,
    gone: Receiver<()>,
}

impl Spinner {
    /// Returns a line on stderr; `None` if stderr is not a terminal.
    pub fn on_terminal() -> Option<Self> {
        std::io::stderr().is_terminal().then(|| {
            let bar = ProgressBar::new_spinner();
            // The template is constant. If it were invalid, the default template would be used.
            if let Ok(style) = ProgressStyle::with_template("{spinner} {msg}") {
                bar.set_style(style);
            }
            let last = bar.clone();
            let draw = move |text| {
                bar.set_message(text);
                bar.tick();
            };
            Self::start(draw, move || last.finish_and_clear())
        })
    }

    fn start(mut draw: impl FnMut(String) + Send + 'static, clear: impl FnOnce() + Send + 'static) -> Self {
        let (texts, to_draw) = sync_channel::<String>(1);
        let (report_gone, gone) = sync_channel(1);
        let run = move || {
            to_draw.iter().for_each(&mut draw);
            clear();
            let _ = report_gone.send(());
        };
        // If the thread cannot be created, nothing is drawn.
        let _ = std::thread::Builder::new().name("spinner".to_owned()).spawn(run);
        Self { texts: Some(texts), gone }
    }

    /// Shows the text, unless the previous text is still being drawn.
    pub fn show(&self, text: String) {
        let _ = self.texts.as_ref().map(|texts| texts.try_send(text));
    }
}

impl Drop for Spinner {
    fn drop(&mut self) {
        self.texts = None;
        let _ = self.gone.recv_timeout(LAST_DRAWING);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_are_drawn_and_a_blocked_terminal_delays_no_thread() {
        let (drawn, seen) = sync_channel(0);
        // Each drawing waits until the test receives it.
        let spinner = Spinner::start(move |text| drop(drawn.send(text)), || {});
        (0..100).for_each(|number| spinner.show(number.to_string()));
        assert_eq!(seen.recv(), Ok("0".to_owned()));
        drop(seen);
        let (held, release) = sync_channel::<()>(0);
        let spinner = Spinner::start(move |_| held.send(()).unwrap_or_default(), || {});
        spinner.show("held".to_owned());
        drop(spinner);
        drop(release);
    }
}
