//! How near is equal: one home for every tolerance of these tests.

/// Printed and computed values of the reference work.
pub const REFERENCE: f64 = 1e-12;
/// Identities of the algebra, after a handful of products.
pub const ALGEBRA: f64 = 1e-13;
/// Logarithms near π, where an angle's digits are lost to the translation's lever.
pub const LOG: f64 = 1e-11;
/// Central finite differences with step 1e-6.
pub const FINITE_DIFFERENCE: f64 = 1e-8;
/// Samples of a closed loop integrated with a fine step.
pub const LOOP: f64 = 1e-6;
