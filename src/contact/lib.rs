#![doc = include_str!("README.md")]
#![warn(clippy::unwrap_used, clippy::expect_used)]
// These macros panic if nobody reads the output. Results go through `cli::print`, everything else through `stderr`.
#![warn(clippy::print_stdout, clippy::print_stderr)]

mod admittance;
mod compliance;
mod contact;
mod load;
mod sign_watch;
#[cfg(test)]
mod tests;
mod wrench_sensor;

pub use admittance::Admittance;
pub use compliance::{Compliance, sizes};
pub use contact::{ContactFault, ContactState};
pub use load::{Identification, Load, TooFewDirections};
pub use wrench_sensor::{WrenchReading, WrenchSensor};

use dq_algebra::UnitDualQuaternion;
use nalgebra::Vector6;

/// Converts a wrench from frame b to frame a. A wrench has the torque \[N m\] about the origin of its frame first, then the force
/// \[N\]. Twists are converted by the adjoint of `a_from_b`, so wrenches are converted by its inverse transpose, and the power
/// stays the same.
fn wrench_in(a_from_b: &UnitDualQuaternion, wrench: &Vector6<f64>) -> Vector6<f64> {
    a_from_b.inverse().adjoint().tr_mul(wrench)
}
