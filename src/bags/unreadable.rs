//! The parts of a bag that could not be read.

use dq_common::text::{REASON, shown};
use std::fmt::Display;
use std::path::Path;

/// The largest number of lines. Further losses are only counted.
const LINES: usize = 20;

/// The parts of a bag that could not be read, one line each.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct UnreadableParts {
    lines: Vec<String>,
    more: u64,
}

impl UnreadableParts {
    /// Adds a line about a part of the file `path` that could not be read.
    pub(super) fn add(&mut self, path: &Path, what: impl Display) {
        // The text may quote the content of the file.
        self.add_line(format!("{path:?}: {}", shown(&what.to_string(), REASON)));
    }

    /// Adds a line that already names the file.
    pub(super) fn add_line(&mut self, line: String) {
        if self.lines.len() < LINES {
            self.lines.push(line);
        } else {
            self.more += 1;
        }
    }

    /// Returns true if nothing has been lost so far.
    pub fn is_empty(&self) -> bool {
        self.lines.is_empty()
    }

    /// Returns the lines. If there are more losses than lines, a final line has the number of further losses.
    pub fn lines(&self) -> impl Iterator<Item = String> + '_ {
        let more = (self.more > 0).then(|| format!("{} more losses", self.more));
        self.lines.iter().cloned().chain(more)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn some_of_many_losses_are_shown_and_all_are_counted() {
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
