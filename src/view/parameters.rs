//! The servo's parameters that the page shows and sets.

use dq_messages::ParameterDescriptor;
use dq_params::Value;
use serde::Serialize;

/// A parameter with its value.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Entry {
    pub name: String,
    #[serde(rename = "type")]
    kind: &'static str,
    value: Option<serde_json::Value>,
    /// The bounds of a number, or of each number in a list; `None` if there is no bound.
    min: Option<f64>,
    max: Option<f64>,
    /// The allowed texts; empty if any text is allowed.
    choices: Vec<String>,
    read_only: bool,
    description: String,
}

impl Entry {
    /// Creates an entry from a descriptor and the parameter's value.
    pub fn new(descriptor: ParameterDescriptor, value: &Value) -> Self {
        let range = descriptor.floating_point_range.first().map(|range| (range.from_value, range.to_value));
        let integers = descriptor.integer_range.first();
        let range = range.or(integers.map(|range| (range.from_value as f64, range.to_value as f64)));
        let choices = descriptor.additional_constraints.strip_prefix("one of ").unwrap_or_default();
        Self {
            kind: descriptor.type_name(),
            value: json(value),
            min: range.map(|(min, _)| min),
            max: range.map(|(_, max)| max),
            choices: choices.split(", ").filter(|name| !name.is_empty()).map(str::to_owned).collect(),
            read_only: descriptor.read_only,
            name: descriptor.name,
            description: descriptor.description,
        }
    }

    /// Replaces the value.
    pub fn set(&mut self, value: &Value) {
        self.value = json(value);
    }

    /// Converts a value that a browser sent to the parameter's type.
    ///
    /// # Errors
    /// A description of the expected value.
    pub fn value_from(&self, sent: &serde_json::Value) -> Result<Value, String> {
        let value = match self.kind {
            "boolean" => sent.as_bool().map(Value::Bool),
            "integer" => sent.as_i64().map(Value::Integer),
            "double" => sent.as_f64().map(Value::Double),
            "string" => sent.as_str().map(|text| Value::String(text.to_owned())),
            "double array" => sent.as_array().and_then(|list| {
                let numbers = list.iter().map(serde_json::Value::as_f64).collect::<Option<_>>();
                numbers.map(Value::DoubleArray)
            }),
            other => return Err(format!("{}: the page cannot set a {other}", self.name)),
        };
        value.ok_or_else(|| format!("{} takes a {}", self.name, self.kind))
    }
}

/// Converts a value to JSON. Returns `None` for a list of a type that the page neither shows nor sets.
fn json(value: &Value) -> Option<serde_json::Value> {
    match value {
        Value::Bool(value) => Some((*value).into()),
        Value::Integer(value) => Some((*value).into()),
        Value::Double(value) => Some((*value).into()),
        Value::String(value) => Some(value.as_str().into()),
        Value::DoubleArray(list) => Some(list.as_slice().into()),
        _ => None,
    }
}
