//! What a parameter is.

use super::{ParameterError, Value};
use std::ops::RangeInclusive;

/// What a parameter's value must satisfy beyond its type.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Constraint {
    /// Nothing.
    None,
    /// A double, or each of a double array, from `min` to `max`.
    Range {
        /// Smallest value.
        min: f64,
        /// Largest value.
        max: f64,
    },
    /// An integer from `min` to `max`.
    IntegerRange {
        /// Smallest value.
        min: i64,
        /// Largest value.
        max: i64,
    },
    /// One of these strings.
    OneOf(&'static [&'static str]),
}

impl Constraint {
    pub(super) fn range(range: RangeInclusive<f64>) -> Self {
        let (min, max) = range.into_inner();
        Self::Range { min, max }
    }
}

/// What a parameter is: name, type, default, bounds and meaning.
#[derive(Clone, Debug, PartialEq)]
pub struct Declaration {
    /// Name, with dots.
    pub name: &'static str,
    /// Its type, and its value where nothing else is said.
    pub default: Value,
    /// What its value must satisfy.
    pub constraint: Constraint,
    /// Unit; empty for none.
    pub unit: &'static str,
    /// What it does.
    pub description: &'static str,
    /// Only settable at start.
    pub read_only: bool,
    /// Whether it is given by whoever describes the robot: no default would serve.
    pub required: bool,
}

impl Declaration {
    /// `value` as this parameter takes it: of its type, and within its constraint.
    ///
    /// # Errors
    /// [`ParameterError::WrongType`], [`ParameterError::Invalid`].
    pub fn check(&self, value: Value) -> Result<Value, ParameterError> {
        let value = value.convert_like(&self.default).map_err(|value| ParameterError::WrongType {
            name: self.name,
            expected: self.default.type_name(),
            got: value.type_name(),
            value,
        })?;
        match self.allows(&value) {
            true => Ok(value),
            false => Err(ParameterError::Invalid {
                name: self.name,
                value: value.to_string(),
                expected: self.expected(),
            }),
        }
    }

    fn allows(&self, value: &Value) -> bool {
        match (self.constraint, value) {
            (Constraint::Range { min, max }, Value::Double(x)) => (min..=max).contains(x),
            (Constraint::Range { min, max }, Value::DoubleArray(list)) => {
                list.iter().all(|x| (min..=max).contains(x))
            }
            (Constraint::IntegerRange { min, max }, Value::Integer(i)) => (min..=max).contains(i),
            (Constraint::OneOf(names), Value::String(name)) => names.contains(&name.as_str()),
            (_, Value::Double(x)) => x.is_finite(),
            (_, Value::DoubleArray(list)) => list.iter().all(|x| x.is_finite()),
            _ => true,
        }
    }

    /// The constraint in words; empty for texts that may be any.
    pub fn expected(&self) -> String {
        let unit = if self.unit.is_empty() { String::new() } else { format!(" {}", self.unit) };
        match self.constraint {
            Constraint::None if matches!(self.default, Value::DoubleArray(_)) => match self.unit {
                "" => "finite numbers".to_owned(),
                unit => format!("finite numbers in {unit}"),
            },
            Constraint::None => String::new(),
            Constraint::Range { min, max } => format!("{min} to {max}{unit}"),
            Constraint::IntegerRange { min, max } => format!("{min} to {max}{unit}"),
            Constraint::OneOf(names) => format!("one of {}", names.join(", ")),
        }
    }
}
