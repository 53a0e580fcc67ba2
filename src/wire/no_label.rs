//! Texts that are no labels.

use std::str::FromStr;

/// A text that is no label, as commands from another program have it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NoLabel;

/// What the text says.
pub(super) fn parse<V: FromStr>(text: &str) -> Result<V, NoLabel> {
    text.parse().map_err(|_| NoLabel)
}
