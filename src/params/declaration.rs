//! What a parameter is.

use super::{ParameterError, Value};
use std::ops::RangeInclusive;

/// What a parameter's value must satisfy beyond its type.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Constraint {
    /// Nothing.
    None,
    /// A number, or each of an array, from `min` to `max`.
    Range {
        /// Smallest value.
        min: f64,
        /// Largest value.
        max: f64,
    },
    /// One of these strings.
    OneOf(&'static [&'static str]),
}

impl From<RangeInclusive<f64>> for Constraint {
    fn from(range: RangeInclusive<f64>) -> Self {
        Self::Range { min: *range.start(), max: *range.end() }
    }
}

impl From<RangeInclusive<i64>> for Constraint {
    fn from(range: RangeInclusive<i64>) -> Self {
        Self::Range { min: *range.start() as f64, max: *range.end() as f64 }
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
        let (name, expected) = (self.name, self.default.type_name());
        let wrong = |value| ParameterError::WrongType { name, expected, value };
        let value = value.convert_like(&self.default).map_err(wrong)?;
        match self.allows(&value) {
            true => Ok(value),
            false => Err(ParameterError::invalid(name, value, self.expected())),
        }
    }

    fn allows(&self, value: &Value) -> bool {
        let in_range = |x: &f64| match self.constraint {
            Constraint::Range { min, max } => (min..=max).contains(x),
            _ => x.is_finite(),
        };
        match (self.constraint, value) {
            (_, Value::Double(x)) => in_range(x),
            (_, Value::DoubleArray(list)) => list.iter().all(in_range),
            (_, Value::Integer(i)) => in_range(&(*i as f64)),
            (Constraint::OneOf(names), Value::String(name)) => names.contains(&name.as_str()),
            _ => true,
        }
    }

    /// The constraint in words; empty for texts that may be any.
    pub fn expected(&self) -> String {
        let unit = |before: &str| {
            if self.unit.is_empty() { String::new() } else { format!("{before}{}", self.unit) }
        };
        match self.constraint {
            Constraint::None if matches!(self.default, Value::DoubleArray(_)) => {
                format!("finite numbers{}", unit(" in "))
            }
            Constraint::None => String::new(),
            Constraint::Range { min, max } => format!("{min} to {max}{}", unit(" ")),
            Constraint::OneOf(names) => format!("one of {}", names.join(", ")),
        }
    }
}
