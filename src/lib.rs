// The links of the README, which have paths of their own there: of two definitions the first one counts.
#![doc = concat!("[fig5]: <file://", env!("CARGO_MANIFEST_DIR"), "/tests/data/fig5.png>\n")]
//! [ros2]: guide::ros2
//! [real_robot]: guide::real_robot
//! [moving_goals]: guide::moving_goals
//! [secured]: guide::secured
//! [commands]: guide::commands
//! [bags]: guide::bags
//! [view]: guide::view
//! [reference_work]: guide::reference_work
//! [laws]: guide::laws
//! [safety]: guide::safety
//! [speed]: guide::speed
//! [upstream]: guide::upstream
//! [contributing]: guide::contributing
//! [`src/dq`]: dq
//! [`src/arm`]: arm
//! [`src/control`]: control
//! [`src/frames`]: frames
//! [`src/servo`]: servo
//! [`src/plant`]: plant
//! [`src/params`]: params
//! [`src/config`]: config
//! [`src/guide`]: guide
#![cfg_attr(
    feature = "ros",
    doc = "
[`src/wire`]: wire
[`src/dds`]: dds
[`src/ros`]: ros
[`src/nodes`]: nodes
[`src/cli`]: cli
"
)]
#![cfg_attr(
    feature = "tools",
    doc = "
[`src/record`]: record
[`src/runs`]: runs
[`src/paper`]: paper
[`src/compare`]: compare
[`src/view`]: view
[`src/draw`]: draw
"
)]
// Where these rooms are not built, nothing is to be shown of them.
#![cfg_attr(
    not(feature = "ros"),
    doc = "
[`src/wire`]: #map
[`src/dds`]: #map
[`src/ros`]: #map
[`src/nodes`]: #map
[`src/cli`]: #map
"
)]
#![cfg_attr(
    not(feature = "tools"),
    doc = "
[`src/record`]: #map
[`src/runs`]: #map
[`src/paper`]: #map
[`src/compare`]: #map
[`src/view`]: #map
[`src/draw`]: #map
"
)]
//!
#![doc = include_str!("../README.md")]
#![warn(clippy::unwrap_used, clippy::expect_used)]
// Both panic where nobody reads: results go through cli::print, all else through stderr.
#![warn(clippy::print_stdout, clippy::print_stderr)]

pub mod arm;
pub mod config;
pub mod control;
pub mod dq;
pub mod frames;
pub mod guide;
pub mod params;
pub mod plant;
pub mod servo;
pub mod text;
mod text_file;

#[cfg(feature = "ros")]
pub mod cli;
#[cfg(feature = "ros")]
mod colors;
#[cfg(feature = "tools")]
pub mod compare;
#[cfg(feature = "ros")]
pub mod dds;
#[cfg(feature = "tools")]
pub mod draw;
#[cfg(feature = "ros")]
mod log_file;
#[cfg(feature = "ros")]
pub mod nodes;
#[cfg(feature = "tools")]
pub mod paper;
#[cfg(feature = "tools")]
pub mod record;
#[cfg(feature = "ros")]
pub mod ros;
#[cfg(feature = "tools")]
pub mod runs;
#[cfg(feature = "ros")]
pub mod stderr;
#[cfg(feature = "tools")]
pub mod view;
#[cfg(feature = "ros")]
pub mod wire;
