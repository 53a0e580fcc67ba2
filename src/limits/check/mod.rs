//! Checks from outside of the servo. The guard stops an arm when commands end. The invariants are the rules that every stream of
//! commands must keep; tests and recorded runs are checked against them.

mod gaps;
mod guard;
mod invariants;
mod slowing;

pub use gaps::Gaps;
pub use guard::{Guard, GuardState, PERIODS as GUARDED_PERIODS};
pub use invariants::Invariants;
