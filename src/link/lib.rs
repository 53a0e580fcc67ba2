//! Connects the servo to its robot: takes joint states, estimates delays and pulls, and checks that the robot is present and follows.
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
mod tracking_monitor;

pub use joint_order::JointOrder;
pub use link::Link;
pub use presence::{Return, Returned, longest_travel};
pub use pull::Hold;
pub use state_error::StateError;
pub use tracking_monitor::Disobedience;

use dq_limits::Limits;
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// A stamp that is ahead of our clock by no more than this counts as now.
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
    /// The number of its publisher.
    pub source: u32,
    /// Its age by its stamp; `None` if the stamp is not in the past.
    pub stamp_age: Option<Duration>,
}

/// Returns the age, at time `clock` \[ns\], of a message with time stamp `stamp` \[ns\] of the same clock: see [`JointReading::stamp_age`].
pub fn stamp_age(clock: i64, stamp: i64) -> Option<Duration> {
    let age = clock.checked_sub(stamp).filter(|age| *age >= -AHEAD_NS)?;
    Some(Duration::from_nanos(age.max(0).unsigned_abs()))
}

/// How an arm follows its commands, as far as is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Contact {
    /// It follows them.
    Following,
    /// It stands, or was not yet seen to respond: it is driven gently.
    Unseen,
    /// It did not follow before, and is being tried gently.
    Lost,
    /// It did not follow, and gets zeros for a while.
    Resting,
    /// Nobody subscribes to its commands.
    Nobody,
    /// Another publisher sends it commands too.
    Contended,
}

/// The estimates about one arm in one control period.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ArmFigures {
    /// How old a command must have been, when the last joint state arrived, to show in that state.
    pub lag: Duration,
    /// The delay that bounds the law's gain: from a command to the joint state that shows it, plus one interval between joint states.
    pub delay: Duration,
    /// The largest lateness of a cycle or of a joint state in the last seconds.
    pub lateness: Duration,
    /// The largest average time between cycles over the duration of a stop, in the last seconds; at least the period.
    pub cycle: Duration,
    /// Whether the arm follows its commands.
    pub contact: Contact,
    /// The fraction of the commanded speed at which the arm moves, at most 1.
    pub factor: f64,
    /// Whether in this cycle the robot appeared, or the servo came back after a gap. The next command then starts at the arm's present
    /// speed.
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
    /// The age at which a joint state is stale.
    pub state_timeout: Duration,
    /// A robot that is silent for longer than this was away.
    pub rearm_timeout: Duration,
    /// The time from a command to the joint state that shows it; `None` to estimate it.
    pub latency: Option<Duration>,
    /// The rate at which the pull at the joints is balanced [1/s]; 0 not to balance it.
    pub integral: f64,
}

/// Converts seconds to a duration; values that are not a time become zero.
pub fn seconds(seconds: f64) -> Duration {
    Duration::try_from_secs_f64(seconds).unwrap_or_default()
}
