//! A claim of the paper, judged.

use serde::Serialize;

/// What the paper says, and what came out.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Claim {
    /// What the paper says.
    pub claim: String,
    /// Whether it holds here.
    pub holds: bool,
    /// By which numbers.
    pub evidence: String,
}

impl Claim {
    pub(super) fn new(claim: impl Into<String>, holds: bool, evidence: String) -> Self {
        Self { claim: claim.into(), holds, evidence }
    }
}
