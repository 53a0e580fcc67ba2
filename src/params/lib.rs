//! ROS 2 parameters for any node: values, declarations, the store, parameter files, and their errors.
//!
//! The example declares a node with one parameter, and starts it with a value from a file:
//!
//! ```
//! use dq_params::{FileParameters, ParameterStore, Parameters, Value};
//! #[derive(Parameters)]
//! struct Follower {
//!     /// how fast the error decays [1/s]
//!     #[parameter(default = 0.5, range = 0.0..=10.0)]
//!     gain: f64,
//! }
//! let mut store = ParameterStore::of::<Follower>()?;
//! assert_eq!(store.read::<Follower>()?.gain, 0.5);
//!
//! let file = FileParameters::read("/**: {ros__parameters: {gain: 2}}", "robot.yaml", "/robot/follower")?;
//! let warnings = store.take("/robot/follower", file.given)?;
//! assert!(warnings.is_empty());
//! assert_eq!(store.read::<Follower>()?.gain, 2.0);
//!
//! // While the node runs, the store checks all changes together before any of them takes effect.
//! let too_much = store.with(&[("gain".to_owned(), Value::Double(11.0))]);
//! assert!(too_much.unwrap_err().to_string().ends_with("expected 0 to 10 1/s"));
//! # Ok::<(), dq_params::ParameterError>(())
//! ```
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
