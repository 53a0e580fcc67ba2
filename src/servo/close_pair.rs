//! Two parts of the space that are near each other.

use crate::space::Pair;

/// Two that are near each other, and how far they are from each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClosePair {
    /// Which.
    pub pair: Pair,
    /// The gap between them \[m\].
    pub distance: f64,
}

impl ClosePair {
    /// The pair and the gap in words; `joint` names a joint by its number.
    pub fn explain(&self, joint: impl Fn(usize) -> String) -> String {
        format!("{} are {:.0} mm apart", self.pair.explain(joint), 1e3 * self.distance)
    }
}
