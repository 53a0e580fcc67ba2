//! The servo cycle: (state, goal, clock) → command and status. Every safety rule lives here.
//!
//! No I/O, no clock, no threads: time is an argument, so that each rule is tested in fake time.

mod cycle;
mod gate;
mod goal;
mod invariants;
mod joints;
mod limits;
mod link;
mod motion;
mod oscillation;
mod position_limits;
mod progress;
mod reason;
mod rejection;
mod settings;
mod stall;
mod state;
mod status;
mod stopping;
mod task;
mod timing;
mod violation;
mod way_out;

pub use cycle::Servo;
pub use gate::Replaced;
pub use goal::Goal;
pub use invariants::Invariants;
pub use joints::JointOrder;
pub use limits::{Limits, STOP_TIME};
pub use link::{ArmFigures, Contact, JointReading, Rearm, Rivals, stamp_age};
pub use motion::{Figures, Motion, Settling};
pub use position_limits::PositionLimits;
pub use reason::Reason;
pub use rejection::{Rejection, RejectionCounts};
pub use settings::{Settings, Tolerance};
pub use stall::{Reach, Stall};
pub use state::State;
pub use status::Status;
pub use task::{GoalError, OneArm, Task, ToolSpeed, TwoArms};
pub use timing::CycleTiming;
pub use violation::Violation;
