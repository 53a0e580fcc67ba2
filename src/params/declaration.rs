//! What a parameter is.

use super::{ParameterError, Value};

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
    /// This boolean and no other: what ROS 2 declares for every node but this one does not do.
    Only(bool),
}

/// A parameter, declared.
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
    /// Whether who describes an arm must give it.
    pub of_every_arm: bool,
}

impl Declaration {
    /// A parameter that may change while the node runs.
    pub fn live(
        name: &'static str,
        default: Value,
        constraint: Constraint,
        unit: &'static str,
        description: &'static str,
    ) -> Self {
        Self { name, default, constraint, unit, description, read_only: false, of_every_arm: false }
    }

    /// A parameter that is fixed at start.
    pub fn fixed(
        name: &'static str,
        default: Value,
        constraint: Constraint,
        unit: &'static str,
        description: &'static str,
    ) -> Self {
        Self { read_only: true, ..Self::live(name, default, constraint, unit, description) }
    }

    /// The same, as a parameter that who describes an arm must give.
    pub fn of_every_arm(self) -> Self {
        Self { of_every_arm: true, ..self }
    }

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
            (Constraint::Only(only), Value::Bool(value)) => only == *value,
            (_, Value::Double(x)) => x.is_finite(),
            (_, Value::DoubleArray(list)) => list.iter().all(|x| x.is_finite()),
            _ => true,
        }
    }

    /// The constraint in words.
    pub fn expected(&self) -> String {
        let unit = if self.unit.is_empty() { String::new() } else { format!(" {}", self.unit) };
        match self.constraint {
            Constraint::None => "finite numbers".to_owned(),
            Constraint::Range { min, max } => format!("{min} to {max}{unit}"),
            Constraint::IntegerRange { min, max } => format!("{min} to {max}{unit}"),
            Constraint::OneOf(names) => format!("one of {}", names.join(", ")),
            Constraint::Only(value) => format!("{value}, since this node has nothing else"),
        }
    }
}
