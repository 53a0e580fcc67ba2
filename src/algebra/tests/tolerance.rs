//! The tolerances of comparisons in algebra and kinematics.

/// Tolerance for values that the reference work (Sathuluri 2018) prints, or that were computed from it.
pub const REFERENCE: f64 = 1e-12;
/// Tolerance for identities of the algebra, after a few products.
pub const ALGEBRA: f64 = 1e-13;
