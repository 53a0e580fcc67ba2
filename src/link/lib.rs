//! What connects the servo to its robot: whose joint states count, how late they are, whether the robot is there and follows.
#![warn(clippy::unwrap_used, clippy::expect_used)]
// Both panic where nobody reads: results go through cli::print, all else through stderr.
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

/// Stamps may be so much ahead of our clock and still count as now.
const AHEAD_NS: i64 = 5_000_000;

/// A joint state as it came.
#[derive(Clone, Copy, Debug)]
pub struct JointReading<'a> {
    /// Joint names.
    pub names: &'a [String],
    /// Joint positions \[rad, prismatic: m\], one a name.
    pub positions: &'a [f64],
    /// Joint velocities [rad/s, prismatic: m/s], one a name, or none.
    pub velocities: &'a [f64],
    /// Who published it: a number for each publisher.
    pub source: u32,
    /// How old it is by its stamp; none where the stamp is no time of the past.
    pub stamp_age: Option<Duration>,
}

/// The age of what was stamped at `stamp` \[ns\] at the time `clock` \[ns\] of the same clock, as [`JointReading::stamp_age`].
pub fn stamp_age(clock: i64, stamp: i64) -> Option<Duration> {
    let age = clock.checked_sub(stamp).filter(|age| *age >= -AHEAD_NS)?;
    Some(Duration::from_nanos(age.max(0).unsigned_abs()))
}

/// What is known of how an arm follows its commands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Contact {
    /// It does.
    Following,
    /// It stands, or has not been seen to move yet: it is driven gently.
    Unseen,
    /// It did not when that was last seen, and is tried, gently.
    Lost,
    /// It did not, and gets zeros for a while.
    Resting,
    /// Nobody subscribes to its commands.
    Nobody,
    /// Another publisher sends it commands too.
    Contended,
}

/// What the link has found out of an arm for one cycle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ArmFigures {
    /// The commands of so long before the last joint state came, and since, are not in it.
    pub lag: Duration,
    /// What bounds the law's gain: the time from a command to the joint state that shows it and to the next one.
    pub delay: Duration,
    /// By how much a cycle or a joint state came too late in the last seconds.
    pub lateness: Duration,
    /// From one cycle to the next, as a stop in the last seconds would have had them at worst; no less than the period counts.
    pub cycle: Duration,
    /// How it follows.
    pub contact: Contact,
    /// The part of the commanded speed at which it moves, at most 1.
    pub factor: f64,
    /// In this cycle the robot has come, or the servo itself after a gap: what the arm does next begins with the speed that it has.
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

/// What the link needs of the settings.
pub struct LinkSettings<'a> {
    /// What the commands never exceed.
    pub limits: &'a Limits,
    /// The age at which a joint state is stale.
    pub state_timeout: Duration,
    /// A robot that is silent for longer was away.
    pub rearm_timeout: Duration,
    /// From a command to the joint state that shows it; none where it is to be estimated.
    pub latency: Option<Duration>,
    /// The rate at which what pulls at the joints is balanced [1/s]; 0 where it is not.
    pub integral: f64,
}

/// So many seconds; zero for what is no time.
pub fn seconds(seconds: f64) -> Duration {
    Duration::try_from_secs_f64(seconds).unwrap_or_default()
}
