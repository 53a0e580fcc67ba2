//! Serial revolute arms: Denavit–Hartenberg rows, forward kinematics, Jacobians.

pub mod bounds;
mod chain;
mod dh;
mod error;
mod half_turns;
mod link;
mod state;
mod urdf;

pub use chain::Chain;
pub use dh::{Convention, DhRow};
pub use error::ArmError;
pub use state::ArmState;
pub use urdf::urdf;
