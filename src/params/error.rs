//! Errors about parameters.

use super::Value;
use super::value::{article, visible};
use std::fmt::Display;
use thiserror::Error;

/// An error about a parameter. Its one-line message names the value and what is expected instead.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum ParameterError {
    /// No parameter has this name.
    #[error("unknown parameter {name:?}{}", nearest.map(|near| format!(": did you mean {near:?}?")).unwrap_or_default())]
    Unknown {
        /// The requested name.
        name: String,
        /// The declared name that is most similar; `None` if no name is similar enough.
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
    /// The user gave only some of a group of parameters that make sense only together.
    #[error("{what} needs {} too: {why}", missing.join(", "))]
    Missing {
        /// What the parameters describe together.
        what: &'static str,
        /// The names of the parameters that are missing.
        missing: Vec<&'static str>,
        /// The reason why there are no useful defaults.
        why: &'static str,
    },
    /// The parameter can be set only when the node starts.
    #[error("parameter {0:?} is read-only while the node runs")]
    ReadOnly(&'static str),
    /// A text is not a valid parameter value.
    #[error("{text:?} is not a parameter value: {why}")]
    NotAValue {
        /// The text.
        text: String,
        /// A description of the error.
        why: String,
    },
    /// A parameter file cannot be read or parsed.
    #[error("{file}: {why}")]
    File {
        /// The name of the file.
        file: String,
        /// A description of the error.
        why: String,
    },
}

impl ParameterError {
    /// Returns the error for a parameter `name` with the value `value`; `expected` describes the allowed values.
    pub fn invalid(name: &'static str, value: impl Display, expected: impl Into<String>) -> Self {
        Self::Invalid { name, value: value.to_string(), expected: expected.into() }
    }
}
