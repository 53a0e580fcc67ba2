//! Checks from outside of the servo: the guard, which stops an arm when commands end, and the rules that every stream of commands must
//! keep, for tests and recorded runs.

mod gaps;
mod guard;
mod invariants;
mod slowing;

pub use gaps::Gaps;
pub use guard::{Guard, GuardState, PERIODS as GUARDED_PERIODS};
pub use invariants::Invariants;
