//! A claim of the paper, with its verdict.

use serde::Serialize;

/// A claim of the paper and its verification.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Claim {
    /// The claim.
    pub claim: String,
    /// Whether it holds here.
    pub holds: bool,
    /// The numbers that show it.
    pub evidence: String,
}

impl Claim {
    pub(super) fn new(claim: impl Into<String>, holds: bool, evidence: String) -> Self {
        Self { claim: claim.into(), holds, evidence }
    }
}
