#![doc = include_str!("README.md")]
#![warn(clippy::unwrap_used, clippy::expect_used)]
// These macros panic if nobody reads the output. Results go through `cli::print`, everything else through `stderr`.
#![warn(clippy::print_stdout, clippy::print_stderr)]

mod arbiter;
mod arm;
mod command_history;
mod comparison;
mod joint_order;
mod latency;
mod lateness;
mod link;
mod parts;
mod presence;
mod pull;
mod rarity;
mod samples;
mod state_error;
#[cfg(test)]
mod tests;
mod tracking_monitor;

pub use arbiter::Arbiter;
pub use joint_order::JointOrder;
pub use link::Link;
pub use presence::{Return, Returned, longest_travel};
pub use pull::Hold;
pub use state_error::StateError;
pub use tracking_monitor::Disobedience;

use dq_limits::Limits;
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// A stamp counts as the present time if it is ahead of this host's clock by at most this many nanoseconds.
const AHEAD_NS: i64 = 5_000_000;

/// A joint state as received.
#[derive(Clone, Copy, Debug)]
pub struct JointReading<'a> {
    /// Joint names.
    pub names: &'a [String],
    /// Joint positions \[rad, prismatic: m\], one per name.
    pub positions: &'a [f64],
    /// Joint velocities [rad/s, prismatic: m/s], one per name, or empty.
    pub velocities: &'a [f64],
    /// The number of the publisher.
    pub source: u32,
    /// The age of the joint state by its stamp; `None` if the stamp is zero or ahead of this host's clock.
    pub stamp_age: Option<Duration>,
}

/// Returns the age of a message with time stamp `stamp` \[ns\] at time `clock` \[ns\]. Returns `None` if the stamp is ahead of the
/// clock by more than 5 ms.
pub fn stamp_age(clock: i64, stamp: i64) -> Option<Duration> {
    let age = clock.checked_sub(stamp).filter(|age| *age >= -AHEAD_NS)?;
    Some(Duration::from_nanos(age.max(0).unsigned_abs()))
}

/// Whether an arm follows its commands, as far as the link knows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Contact {
    /// The arm follows.
    Following,
    /// The arm stands, or has not yet responded to a command. The servo limits its commands to a low speed.
    Unseen,
    /// The arm did not follow. The servo tries to move it again, at a low speed.
    Lost,
    /// The arm did not follow. The servo sends zeros for a while.
    Resting,
    /// Nobody subscribes to the commands for the arm.
    Nobody,
    /// Another publisher sends commands to the arm, too.
    Contended,
}

/// The link's estimates about one arm in one cycle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ArmFigures {
    /// The delay of the last joint state: its age on arrival plus the robot's response time. A latency set by parameter replaces this
    /// sum.
    pub lag: Duration,
    /// The delay that limits the law's gain: the time from a command to the joint state that shows its effect, plus one interval of
    /// joint states.
    pub delay: Duration,
    /// The largest lateness of a cycle or of a joint state in the last 2 to 4 s.
    pub lateness: Duration,
    /// The largest average time between cycles in the last 2 to 4 s, and at least the control period. Each average covers about as many
    /// cycles as a stop takes.
    pub cycle: Duration,
    /// Whether the arm follows its commands.
    pub contact: Contact,
    /// The fraction of its commanded speed at which the arm moves, at most 1.
    pub factor: f64,
    /// Whether the next command must start at the arm's present speed, because the robot has appeared, or the cycles have resumed
    /// after a gap.
    pub came: bool,
}

impl Default for ArmFigures {
    fn default() -> Self {
        Self {
            lag: Duration::ZERO,
            delay: Duration::ZERO,
            lateness: Duration::ZERO,
            cycle: Duration::ZERO,
            contact: Contact::Unseen,
            factor: 1.0,
            came: false,
        }
    }
}

/// The settings that the link uses.
pub struct LinkSettings<'a> {
    /// The limits of the commands.
    pub limits: &'a Limits,
    /// The largest age of a joint state that the servo uses.
    pub state_timeout: Duration,
    /// A pause in the joint states that is longer than this revokes consent.
    pub rearm_timeout: Duration,
    /// The time from a command to the joint state that shows its effect; `None` to estimate it.
    pub latency: Option<Duration>,
    /// The rate at which the servo balances the effect of a payload or of gravity on the joints [1/s]; 0 if it does not.
    pub integral: f64,
}

/// Converts seconds to a duration. A negative, infinite or NaN value becomes zero.
pub fn seconds(seconds: f64) -> Duration {
    Duration::try_from_secs_f64(seconds).unwrap_or_default()
}
