//! The tolerances of comparisons in algebra and kinematics.

/// For printed and computed values of the reference work.
pub const REFERENCE: f64 = 1e-12;
/// For identities of the algebra, after a few products.
pub const ALGEBRA: f64 = 1e-13;
