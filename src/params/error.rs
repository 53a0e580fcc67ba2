//! Errors about parameters.

use super::Value;
use super::value::{article, visible};
use std::fmt::Display;
use thiserror::Error;

/// An error about a parameter. Its one-line message names the value and what is expected.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum ParameterError {
    /// No parameter has this name.
    #[error("unknown parameter {name:?}{}", nearest.map(|near| format!(": did you mean {near:?}?")).unwrap_or_default())]
    Unknown {
        /// The requested name.
        name: String,
        /// The declared name that is most similar to it.
        nearest: Option<&'static str>,
    },
    /// The value has the wrong type.
    #[error("parameter {name:?} is {} {expected}, got the {} {}", article(expected), value.type_name(), visible(value))]
    WrongType {
        /// The parameter's name.
        name: &'static str,
        /// The parameter's type.
        expected: &'static str,
        /// The given value.
        value: Value,
    },
    /// The value is not allowed.
    #[error("parameter {name:?} cannot be {}: expected {expected}", visible(value))]
    Invalid {
        /// The parameter's name.
        name: &'static str,
        /// The given value.
        value: String,
        /// The values that are allowed.
        expected: String,
    },
    /// Some parameters that only make sense together are not given.
    #[error("{what} needs {} too: {why}", missing.join(", "))]
    Missing {
        /// The thing that the parameters describe together.
        what: &'static str,
        /// The parameters that are not given.
        missing: Vec<&'static str>,
        /// The reason why there are no useful defaults.
        why: &'static str,
    },
    /// The parameter can only be set at start.
    #[error("parameter {0:?} is read-only while the node runs")]
    ReadOnly(&'static str),
    /// A text is not a valid parameter value.
    #[error("{text:?} is not a parameter value: {why}")]
    NotAValue {
        /// The text.
        text: String,
        /// Description of the error.
        why: String,
    },
    /// A parameter file cannot be read or parsed.
    #[error("{file}: {why}")]
    File {
        /// The file.
        file: String,
        /// Description of the error.
        why: String,
    },
}

impl ParameterError {
    /// Returns the error that parameter `name` has the value `value` instead of `expected`.
    pub fn invalid(name: &'static str, value: impl Display, expected: impl Into<String>) -> Self {
        Self::Invalid { name, value: value.to_string(), expected: expected.into() }
    }
}
