//! How near is equal, of algebra and kinematics.

/// Printed and computed values of the reference work.
pub const REFERENCE: f64 = 1e-12;
/// Identities of the algebra, after a handful of products.
pub const ALGEBRA: f64 = 1e-13;
