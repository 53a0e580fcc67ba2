//! What the Python package has of this crate, as the module `dq_servo._native`: poses, chains, laws, the servo in fake time, bags, and the
//! comparison of laws. Arrays are numpy's; what is wrong is a `ValueError` with this crate's own words.
#![warn(clippy::unwrap_used, clippy::expect_used)]
// Both panic where nobody reads: results go through cli::print, all else through stderr.
#![warn(clippy::print_stdout, clippy::print_stderr)]

mod algebra;
mod arrays;
mod chain;
mod compare;
mod law;
mod parameters;
mod pose;
mod runs;
mod servo;

use pyo3::prelude::*;

/// The module.
#[pymodule(name = "_native")]
mod native {
    #[pymodule_export]
    use super::algebra::{
        conjugate, dual_hamilton_minus, dual_hamilton_plus, hamilton_minus, hamilton_plus, multiply,
    };
    #[pymodule_export]
    use super::chain::{Chain, arms};
    #[pymodule_export]
    use super::compare::{compared, settling_gain, tasks};
    #[pymodule_export]
    use super::law::{Law, laws};
    #[pymodule_export]
    use super::pose::Pose;
    #[pymodule_export]
    use super::runs::{Run, recorded, replay};
    #[pymodule_export]
    use super::servo::Servo;
}
