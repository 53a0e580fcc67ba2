//! Parses values, and maps of values, from YAML.

use super::{ParameterError, Value};
use serde::de::value::SeqAccessDeserializer;
use serde::de::{MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};
use serde_saphyr::{NonFiniteFloatPolicy, Options};
use std::fmt;

/// A YAML node. Its maps keep the order of the document.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Yaml {
    Nothing,
    Value(Value),
    Map(Vec<(String, Yaml)>),
}

/// The types of lists, in the order in which the parser tries them. A list of integers and doubles is a list of doubles.
#[derive(Deserialize)]
#[expect(clippy::enum_variant_names, reason = "they are those of Value")]
#[serde(remote = "Value", untagged, expecting = "expected all elements of a list to have one type")]
enum List {
    StringArray(Vec<String>),
    BoolArray(Vec<bool>),
    IntegerArray(Vec<i64>),
    DoubleArray(Vec<f64>),
}

impl Value {
    /// Parses `text` as YAML, as `ros2 param set` and `-p name:=text` do.
    ///
    /// # Errors
    /// [`ParameterError::NotAValue`] if the text is not a value.
    pub fn from_yaml(text: &str) -> Result<Self, ParameterError> {
        let error = |why| ParameterError::NotAValue { text: text.to_owned(), why };
        match Yaml::read(text).map_err(error)? {
            Yaml::Value(value) => Ok(value),
            Yaml::Nothing => Err(error("expected a value, got nothing".to_owned())),
            Yaml::Map(_) => Err(error("expected a value or a list, got a map".to_owned())),
        }
    }
}

impl Yaml {
    /// Reads a document. Like rcl, accepts infinite and undefined numbers.
    ///
    /// # Errors
    /// A one-line description of the error.
    pub fn read(text: &str) -> Result<Self, String> {
        let mut options = Options::default();
        options.non_finite_float_policy = NonFiniteFloatPolicy::PassThrough;
        serde_saphyr::from_str_with_options(text, options).map_err(|why| one_line(&why))
    }
}

/// Returns the first line of an error's text, for an operator. Leaves out the word "error" and advice for programmers.
pub fn one_line(error: &impl fmt::Display) -> String {
    const TO_PROGRAMMERS: [&str; 2] = [", set DuplicateKeyPolicy", "; use from_str"];
    let text = error.to_string();
    let line = text.lines().next().unwrap_or_default().trim_start_matches("error:").trim();
    TO_PROGRAMMERS.iter().fold(line, |line, words| line.split(words).next().unwrap_or(line)).to_owned()
}

impl<'de> Deserialize<'de> for Yaml {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Any;
        impl<'de> Visitor<'de> for Any {
            type Value = Yaml;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("YAML")
            }
            fn visit_unit<E>(self) -> Result<Yaml, E> {
                Ok(Yaml::Nothing)
            }
            fn visit_bool<E>(self, value: bool) -> Result<Yaml, E> {
                Ok(Yaml::Value(Value::Bool(value)))
            }
            fn visit_i64<E>(self, value: i64) -> Result<Yaml, E> {
                Ok(Yaml::Value(Value::Integer(value)))
            }
            /// Returns a double if the number is too large for an integer.
            fn visit_u64<E>(self, value: u64) -> Result<Yaml, E> {
                let integer = i64::try_from(value).map(Value::Integer);
                Ok(Yaml::Value(integer.unwrap_or(Value::Double(value as f64))))
            }
            fn visit_f64<E>(self, value: f64) -> Result<Yaml, E> {
                Ok(Yaml::Value(Value::Double(value)))
            }
            fn visit_str<E>(self, value: &str) -> Result<Yaml, E> {
                Ok(Yaml::Value(Value::String(value.to_owned())))
            }
            fn visit_seq<A: SeqAccess<'de>>(self, items: A) -> Result<Yaml, A::Error> {
                List::deserialize(SeqAccessDeserializer::new(items)).map(Yaml::Value)
            }
            fn visit_map<A: MapAccess<'de>>(self, mut entries: A) -> Result<Yaml, A::Error> {
                let mut map = Vec::new();
                while let Some(entry) = entries.next_entry()? {
                    map.push(entry);
                }
                Ok(Yaml::Map(map))
            }
        }
        deserializer.deserialize_any(Any)
    }
}
