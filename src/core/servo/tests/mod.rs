//! Unit tests of private modules.

mod consent;
mod error_trend;
mod explanation;
mod oscillation;
mod progress;
mod reconfiguration;
mod setpoint;
mod stability;
