//! Unit tests of private modules.

mod arbiter;
mod lateness;
mod presence;
mod tracking_monitor;
