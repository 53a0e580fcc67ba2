//! Declarations of parameters.

use super::{ParameterError, Value};
use std::ops::RangeInclusive;

/// A condition on a parameter's value in addition to its type.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Constraint {
    /// No condition.
    None,
    /// A number, or each number of an array, lies between `min` and `max`, both included.
    Range {
        /// Smallest value.
        min: f64,
        /// Largest value.
        max: f64,
    },
    /// The value is one of these strings.
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

/// A declared parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Declaration {
    /// The full name of the parameter. Dots separate its namespaces.
    pub name: &'static str,
    /// The default value, which also determines the type.
    pub default: Value,
    /// The condition on the value.
    pub constraint: Constraint,
    /// The unit, or an empty string if there is none.
    pub unit: &'static str,
    /// A description of what the parameter does.
    pub description: &'static str,
    /// Whether a value can be set only when the node starts.
    pub read_only: bool,
    /// Whether the user must give a value, because it describes the robot and no default would be useful.
    pub required: bool,
}

impl Declaration {
    /// Converts `value` to this parameter's type, and checks the constraint.
    ///
    /// # Errors
    /// [`ParameterError::WrongType`] if `value` cannot be converted, [`ParameterError::Invalid`] if it violates the constraint.
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

    /// Returns the allowed values in words, with their unit, such as "0 to 1 m". If there is no constraint, the text is empty. Only for a
    /// list of doubles, it is then "finite numbers" with the unit.
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
