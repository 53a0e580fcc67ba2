//! Values from YAML.

use super::yaml::Yaml;
use super::{ParameterError, Value};

impl Value {
    /// The value that `text` has in YAML, as `ros2 param set` and `-p name:=text` read it.
    ///
    /// # Errors
    /// [`ParameterError::NotAValue`].
    pub fn from_yaml(text: &str) -> Result<Self, ParameterError> {
        let error = |why: String| ParameterError::NotAValue { text: text.to_owned(), why };
        Self::try_from(Yaml::read(text).map_err(error)?).map_err(error)
    }
}

impl TryFrom<Yaml> for Value {
    type Error = String;

    fn try_from(yaml: Yaml) -> Result<Self, String> {
        match yaml {
            Yaml::Bool(value) => Ok(Self::Bool(value)),
            Yaml::Integer(value) => Ok(Self::Integer(value)),
            Yaml::Double(value) => Ok(Self::Double(value)),
            Yaml::String(value) => Ok(Self::String(value)),
            Yaml::List(list) => array(&list),
            Yaml::Null => Err("expected a value, got nothing".to_owned()),
            Yaml::Map(_) => Err("expected a value or a list, got a map".to_owned()),
        }
    }
}

/// An array of one type; integers among doubles count as doubles.
fn array(list: &[Yaml]) -> Result<Value, String> {
    let each = |take: fn(&Yaml) -> bool| list.iter().all(take);
    if each(|item| matches!(item, Yaml::Integer(_))) && !list.is_empty() {
        return Ok(Value::IntegerArray(list.iter().filter_map(Yaml::integer).collect()));
    }
    if each(|item| matches!(item, Yaml::Integer(_) | Yaml::Double(_))) && !list.is_empty() {
        return Ok(Value::DoubleArray(list.iter().filter_map(Yaml::double).collect()));
    }
    if each(|item| matches!(item, Yaml::Bool(_))) && !list.is_empty() {
        return Ok(Value::BoolArray(list.iter().map(|item| *item == Yaml::Bool(true)).collect()));
    }
    if each(|item| matches!(item, Yaml::String(_))) {
        return Ok(Value::StringArray(list.iter().filter_map(Yaml::string).collect()));
    }
    Err("expected all elements of a list to have one type".to_owned())
}
