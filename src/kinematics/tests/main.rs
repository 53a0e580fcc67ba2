//! Arms, Jacobians and laws, compared with the reference work (Sathuluri 2018) and with other implementations.

mod aims;
mod arm;
mod control;
mod cooperative;
mod jacobians;
mod law_memory;
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

/// Tolerance for the samples of a closed loop that is integrated with a fine step.
const LOOP: f64 = 1e-6;
