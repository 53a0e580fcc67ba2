//! Prints results to stdout.

use super::error::bail;
use super::signals::Signals;
use std::fmt::Arguments;
use std::io::{ErrorKind, Write};
use thiserror::Error;

/// Writing to stdout failed.
#[derive(Debug, Error)]
#[error("the results cannot be written to stdout")]
pub(super) struct StdoutError(#[from] std::io::Error);

impl StdoutError {
    /// Returns whether the reader has closed stdout, as `| head -1` does. A closed stdout is not a failure.
    pub fn is_closed(&self) -> bool {
        self.0.kind() == ErrorKind::BrokenPipe
    }
}

/// Prints a line.
///
/// # Errors
/// [`StdoutError`].
pub(super) fn line(text: Arguments<'_>) -> Result<(), StdoutError> {
    let mut out = std::io::stdout().lock();
    writeln!(out, "{text}")?;
    Ok(out.flush()?)
}

/// Prints the results of a command that handles signals. If stdout blocks, another signal ends the command.
///
/// # Errors
/// [`StdoutError`], or an error if a signal arrived.
pub(super) async fn results(text: String, signals: &mut Signals) -> super::Result<()> {
    let written = tokio::task::spawn_blocking(move || line(format_args!("{text}")));
    tokio::select! {
        written = written => Ok(written??),
        () = signals.next() => bail!("interrupted while stdout was blocked"),
    }
}

/// Prints a line like `println!`, but returns a [`Result`] instead of panicking.
macro_rules! print_line {
    ($($argument:tt)*) => { $crate::cli::print::line(format_args!($($argument)*)) };
}
pub(super) use print_line;

/// Rounds a number for display: a length in m, or a component of a quaternion. Replaces -0 by 0.
pub(super) fn short(number: f64) -> f64 {
    const DIGITS: f64 = 1e12;
    (number * DIGITS).round() / DIGITS + 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_errors_are_not_shown() {
        let shown =
            [0.1 + 0.2, -8.4e-19, -0.44799999999999995, 1.0 / 3.0].map(|number| short(number).to_string());
        assert_eq!(shown, ["0.3", "0", "-0.448", "0.333333333333"]);
    }
}
