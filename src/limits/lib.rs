#![doc = include_str!("README.md")]
#![warn(clippy::unwrap_used, clippy::expect_used)]
// These macros panic if nobody reads the output. Results go through `cli::print`, everything else through `stderr`.
#![warn(clippy::print_stdout, clippy::print_stderr)]

mod envelope;
mod interface;
mod joints;
mod latched_limits;
mod limits;
mod pace;
mod position_limits;
mod scaling;
mod span;
#[cfg(test)]
mod tests;
mod violation;

pub use envelope::Envelope;
pub use interface::Interface;
pub use joints::Joints;
pub use latched_limits::LatchedLimits;
pub use limits::{Approach, Braking, JOINT_JERKS, JOINT_SPEEDS, Limits, POSITIVE, RAMP_TIME, STOP_TIME};
pub use pace::Pace;
pub use position_limits::PositionLimits;
use scaling::between;
pub use scaling::{ratio, scale};
pub use span::Span;
pub use violation::Violation;
