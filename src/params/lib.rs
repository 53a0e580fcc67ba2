//! What any ROS 2 node has: values, declarations, the store, parameter files, and their errors.
//!
//! A node of one parameter, which starts with what a file gives it:
//!
//! ```
//! use dq_params::{Declarer, FileParameters, ParameterStore, Value};
//! // One expression declares a parameter and reads its value.
//! let gain = |p: &mut Declarer| p.double("gain", 0.5, 0.0..=10.0).live("1/s", "how fast the error decays");
//! let mut declarer = Declarer::new([]);
//! assert_eq!(gain(&mut declarer), 0.5);
//! let mut store = ParameterStore::new(declarer.into_declarations(), Vec::new());
//!
//! let file = FileParameters::read("/**: {ros__parameters: {gain: 2}}", "robot.yaml", "/robot/follower")?;
//! let warnings = store.take("/robot/follower", file.given)?;
//! assert!(warnings.is_empty());
//! assert_eq!(store.get("gain"), Some(&Value::Double(2.0)));
//!
//! // While it runs: a change is checked as a whole before any of it is made.
//! let too_much = store.with(&[("gain".to_owned(), Value::Double(11.0))]);
//! assert!(too_much.unwrap_err().to_string().ends_with("expected 0 to 10 1/s"));
//! # Ok::<(), dq_params::ParameterError>(())
//! ```
#![warn(clippy::unwrap_used, clippy::expect_used)]
// Both panic where nobody reads: results go through cli::print, all else through stderr.
#![warn(clippy::print_stdout, clippy::print_stderr)]

mod declaration;
mod declarer;
mod error;
mod file;
mod given;
mod list;
mod nearest;
mod parse;
mod store;
mod value;
mod yaml;

pub use declaration::{Constraint, Declaration};
pub use declarer::{Declarer, Row};
pub use error::ParameterError;
pub use file::{FileParameters, parameters_for};
pub use given::Given;
pub use list::List;
pub use nearest::{is_misspelt, nearest, shares_namespace};
pub use store::ParameterStore;
pub use value::Value;
pub use yaml::one_line;
