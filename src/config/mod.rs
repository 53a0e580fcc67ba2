//! Parameters: each declared once, with type, unit, range, default and description.

mod common;
mod cycle;
mod declaration;
mod dual;
mod file;
mod initial;
mod nearest;
mod plant;
mod servo;
mod store;
mod value;

pub use common::ArmParameters;
pub use cycle::CycleParameters;
pub use declaration::{Constraint, Declaration};
pub use dual::DualParameters;
pub use file::{FileParameter, FileParameters, parameters_for};
pub use initial::Given;
pub use nearest::nearest;
pub use plant::PlantParameters;
pub use servo::ServoParameters;
pub use store::ParameterStore;
pub use value::Value;

use thiserror::Error;

/// The parameter file that is built in: the PUMA 560 of the reference work.
pub const BUILTIN_FILE: &str = include_str!("../../msg_config/puma560.yaml");

/// The parameters of one kind of node.
pub trait NodeParameters: Sized {
    /// The node's default name.
    const NODE_NAME: &'static str;

    /// Each parameter, declared.
    fn declarations() -> Vec<Declaration>;

    /// The typed parameters of `store`.
    ///
    /// # Errors
    /// [`ConfigError`] where values do not fit each other.
    fn from_store(store: &ParameterStore) -> Result<Self, ConfigError>;

    /// A store with the declarations at their defaults.
    fn store() -> ParameterStore {
        let of_all = [
            ServoParameters::declarations(),
            DualParameters::declarations(),
            PlantParameters::declarations(),
        ];
        ParameterStore::new(
            Self::declarations(),
            of_all.iter().flatten().map(|declared| declared.name).collect(),
        )
    }
}

/// A parameter that cannot be as it was asked for. One line: the value, and what would be right.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum ConfigError {
    /// No such parameter.
    #[error("unknown parameter {name:?}{}", nearest.map(|near| format!(": did you mean {near:?}?")).unwrap_or_default())]
    Unknown {
        /// The name that was asked for.
        name: String,
        /// The declared name nearest to it.
        nearest: Option<&'static str>,
    },
    /// Another type.
    #[error(
        "parameter {name:?} is {} {expected}, got the {got} {}",
        value::article(expected),
        value::visible(value)
    )]
    WrongType {
        /// The parameter.
        name: &'static str,
        /// Its type.
        expected: &'static str,
        /// The type of the value.
        got: &'static str,
        /// The value.
        value: Value,
    },
    /// A value that is not allowed.
    #[error("parameter {name:?} cannot be {}: expected {expected}", value::visible(value))]
    Invalid {
        /// The parameter.
        name: &'static str,
        /// The value.
        value: String,
        /// What would be right.
        expected: String,
    },
    /// An arm is described, but not all of it.
    #[error("an arm needs {} too: once `joints` or any `arm.*` is given, nothing of the built-in arm is used", missing.join(", "))]
    IncompleteArm {
        /// The parameters that are not given.
        missing: Vec<&'static str>,
    },
    /// Only settable at start.
    #[error("parameter {0:?} is read-only while the node runs")]
    ReadOnly(&'static str),
    /// A text that is no parameter value.
    #[error("{text:?} is no parameter value: {why}")]
    NotAValue {
        /// The text.
        text: String,
        /// What is wrong.
        why: String,
    },
    /// A parameter file that does not parse.
    #[error("{file}: {why}")]
    File {
        /// The file.
        file: String,
        /// What is wrong.
        why: String,
    },
}
