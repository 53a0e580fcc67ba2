//! The module `dq_servo._native`, which is the Rust part of the Python package: poses, chains, laws, the servo cycle by cycle,
//! bags, and the comparison of laws. Arrays are numpy arrays. Errors of the Rust crates become `ValueError`s with the same message.
#![warn(clippy::unwrap_used, clippy::expect_used)]
// These macros panic if nobody reads the output. Results go through `cli::print`, everything else through `stderr`.
#![warn(clippy::print_stdout, clippy::print_stderr)]

mod algebra;
mod arrays;
mod chain;
mod compare;
mod joints;
mod law;
mod own_law;
mod parameters;
mod pose;
mod runs;
mod servo;
mod time;

use pyo3::prelude::*;

/// The module `dq_servo._native`.
#[pymodule(name = "_native")]
mod native {
    use pyo3::prelude::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }

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
