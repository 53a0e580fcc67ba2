//! The tolerances of comparisons in algebra and kinematics.

/// Tolerance for printed and computed values of the reference work.
pub const REFERENCE: f64 = 1e-12;
/// Tolerance for identities of the algebra, after a few products.
pub const ALGEBRA: f64 = 1e-13;
