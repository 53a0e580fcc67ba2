//! The enter key of a terminal.

use rustix::{process, stdio, termios};
use std::io::IsTerminal;
use tokio::sync::oneshot;

/// Returns a future that waits until the enter key is pressed. Returns `None` if no user can press the key: there is no terminal, or
/// this process runs in the background.
pub(super) fn pressed() -> Option<impl Future<Output = ()>> {
    let is_here = std::io::stdin().is_terminal() && std::io::stderr().is_terminal();
    // A background process that reads from a terminal is stopped.
    let is_in_front = || termios::tcgetpgrp(stdio::stdin()).is_ok_and(|group| group == process::getpgrp());
    (is_here && is_in_front()).then(|| {
        let (pressed, seen) = oneshot::channel();
        // Reading blocks until the key is pressed. It has its own thread, which does not keep the program alive.
        let read = move || std::io::stdin().read_line(&mut String::new()).map(|_| pressed.send(()));
        let _ = std::thread::Builder::new().name("enter key".to_owned()).spawn(read);
        async {
            if seen.await.is_err() {
                std::future::pending().await
            }
        }
    })
}
