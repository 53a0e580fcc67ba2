//! Arms, Jacobians and laws compared with the reference work, with other implementations and with themselves.

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

/// Tolerance of the samples of a closed loop integrated with a fine step.
const LOOP: f64 = 1e-6;
