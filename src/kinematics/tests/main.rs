//! Arms, Jacobians and laws against the reference work, other implementations and themselves.

mod aims;
mod arm;
mod control;
mod cooperative;
mod jacobians;
mod laws;
mod odd_arms;
mod plain;
mod puma;
#[path = "../../algebra/tests/reference.rs"]
mod reference;
mod second_order;
mod step;
mod tasks;
#[path = "../../algebra/tests/tolerance.rs"]
mod tolerance;

/// Samples of a closed loop integrated with a fine step.
const LOOP: f64 = 1e-6;
