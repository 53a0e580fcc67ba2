//! Who looks at the servo from outside: the guard of an arm, which stops it when commands cease, and the check of what every stream of
//! commands must hold, for tests and recorded runs.

mod gaps;
mod guard;
mod invariants;
mod slowing;

pub use gaps::Gaps;
pub use guard::{Guard, GuardState, PERIODS as GUARDED_PERIODS};
pub use invariants::Invariants;
