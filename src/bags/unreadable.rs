//! What of a bag could not be read.

use dq_common::text::{REASON, shown};
use std::fmt::Display;
use std::path::Path;

/// Lines that are kept; of more only the number is.
const LINES: usize = 20;

/// What of a bag could not be read, a line for each loss.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct UnreadableParts {
    lines: Vec<String>,
    more: u64,
}

impl UnreadableParts {
    /// Adds what was lost of that file.
    pub(super) fn add(&mut self, path: &Path, what: impl Display) {
        // What is wrong is said in part with the file's own words.
        self.add_line(format!("{path:?}: {}", shown(&what.to_string(), REASON)));
    }

    /// Adds a line that names the file already.
    pub(super) fn add_line(&mut self, line: String) {
        if self.lines.len() < LINES {
            self.lines.push(line);
        } else {
            self.more += 1;
        }
    }

    /// Whether the bag was whole as far as it has been read.
    pub fn is_empty(&self) -> bool {
        self.lines.is_empty()
    }

    /// The lines, the last of which counts those that are not shown.
    pub fn lines(&self) -> impl Iterator<Item = String> + '_ {
        let more = (self.more > 0).then(|| format!("{} more losses", self.more));
        self.lines.iter().cloned().chain(more)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_many_losses_some_are_shown_and_all_are_counted() {
        let mut losses = UnreadableParts::default();
        assert!(losses.is_empty());
        (0..1000).for_each(|number| losses.add(Path::new("bag"), number));
        let lines: Vec<_> = losses.lines().collect();
        assert_eq!(
            (lines.len(), lines[0].as_str(), lines[20].as_str()),
            (21, "\"bag\": 0", "980 more losses")
        );
    }
}
