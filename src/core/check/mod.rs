//! Who looks at the servo from outside: the guard of an arm, which stops it when commands cease; the check of what every stream of commands
//! must hold, for tests and recorded runs; and how punctual the cycle is.

mod gaps;
mod guard;
mod invariants;
mod slowing;
mod timing;

pub use gaps::Gaps;
pub use guard::{Guard, GuardState, PERIODS as GUARDED_PERIODS};
pub use invariants::Invariants;
pub use timing::{CycleTiming, SpreadFigures, TimingFigures};
