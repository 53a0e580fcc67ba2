#![doc = include_str!("README.md")]
#![warn(clippy::unwrap_used, clippy::expect_used)]
// These macros panic if nobody reads the output. Results go through `cli::print`, everything else through `stderr`.
#![warn(clippy::print_stdout, clippy::print_stderr)]

#[cfg(all(feature = "jazzy", feature = "humble"))]
compile_error!(
    "a program is built for one release of ROS 2; for Humble: --no-default-features --features humble"
);
#[cfg(not(any(feature = "jazzy", feature = "humble")))]
compile_error!(
    "choose the release of ROS 2: --features jazzy (every release from Iron on) or --features humble"
);

#[cfg(any(test, feature = "test-util"))]
pub mod alone;
mod dds;
pub mod log_file;
pub mod ros;
pub mod stderr;
