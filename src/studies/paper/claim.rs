//! A claim of the paper, with its verdict.

use serde::Serialize;

/// A claim of the paper, and its verdict.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Claim {
    /// The claim in words.
    pub claim: String,
    /// Whether the claim holds in this program's results.
    pub holds: bool,
    /// The numbers that show whether the claim holds.
    pub evidence: String,
}

impl Claim {
    pub(super) fn new(claim: impl Into<String>, holds: bool, evidence: String) -> Self {
        Self { claim: claim.into(), holds, evidence }
    }
}
