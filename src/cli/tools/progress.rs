//! The progress of something long.

use indicatif::{ProgressBar, ProgressStyle};

/// A bar over so many of `what`, on a terminal only.
pub(super) fn progress(what: &str, count: u64) -> ProgressBar {
    let bar = ProgressBar::new(count).with_message(what.to_owned());
    // The template is a constant; without it the default one serves.
    match ProgressStyle::with_template("{msg} {bar:40} {pos}/{len}, {eta} left") {
        Ok(style) => bar.with_style(style),
        Err(_) => bar,
    }
}
