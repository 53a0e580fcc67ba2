//! Unit tests of private modules.

mod arbiter;
mod command_history;
mod lateness;
mod presence;
mod tracking_monitor;
mod two_arms;

use std::time::Duration;

const MS: Duration = Duration::from_millis(1);
