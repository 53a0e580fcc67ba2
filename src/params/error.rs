//! What is wrong with a parameter.

use super::Value;
use super::value::{article, visible};
use std::fmt::Display;
use thiserror::Error;

/// A parameter that cannot be as it was asked for. One line: the value, and what would be right.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum ParameterError {
    /// No such parameter.
    #[error("unknown parameter {name:?}{}", nearest.map(|near| format!(": did you mean {near:?}?")).unwrap_or_default())]
    Unknown {
        /// The name that was asked for.
        name: String,
        /// The declared name nearest to it.
        nearest: Option<&'static str>,
    },
    /// Another type.
    #[error("parameter {name:?} is {} {expected}, got the {} {}", article(expected), value.type_name(), visible(value))]
    WrongType {
        /// The parameter.
        name: &'static str,
        /// Its type.
        expected: &'static str,
        /// The value.
        value: Value,
    },
    /// A value that is not allowed.
    #[error("parameter {name:?} cannot be {}: expected {expected}", visible(value))]
    Invalid {
        /// The parameter.
        name: &'static str,
        /// The value.
        value: String,
        /// What would be right.
        expected: String,
    },
    /// Parameters that make sense only together, of which some are not given.
    #[error("{what} needs {} too: {why}", missing.join(", "))]
    Missing {
        /// What they make together.
        what: &'static str,
        /// The parameters that are not given.
        missing: Vec<&'static str>,
        /// Why no others serve.
        why: &'static str,
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

impl ParameterError {
    /// The parameter of that name has `value` where `expected` should be.
    pub fn invalid(name: &'static str, value: impl Display, expected: impl Into<String>) -> Self {
        Self::Invalid { name, value: value.to_string(), expected: expected.into() }
    }
}
