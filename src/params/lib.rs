#![doc = include_str!("README.md")]
#![warn(clippy::unwrap_used, clippy::expect_used)]
// These macros panic if nobody reads the output. Results go through `cli::print`, everything else through `stderr`.
#![warn(clippy::print_stdout, clippy::print_stderr)]

// The code from the derive macro has paths that begin with `dq_params`.
extern crate self as dq_params;

mod declaration;
mod error;
mod file;
mod nearest;
mod parameters;
mod store;
mod value;
mod yaml;

pub use declaration::{Constraint, Declaration};
pub use dq_params_derive::Parameters;
pub use error::ParameterError;
pub use file::{FileParameters, ParameterOverride, parameters_for};
pub use nearest::{is_misspelt, nearest, shares_namespace};
pub use parameters::{Declarer, ParameterType, Parameters, exactly};
pub use store::ParameterStore;
pub use value::Value;
pub use yaml::one_line;
