//! A YAML document.

use serde::de::{Deserialize, Deserializer, MapAccess, SeqAccess, Visitor};
use serde_saphyr::{NonFiniteFloatPolicy, Options};
use std::fmt;

/// Any YAML node, with maps in the order of the document.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Yaml {
    Null,
    Bool(bool),
    Integer(i64),
    Double(f64),
    String(String),
    List(Vec<Yaml>),
    Map(Vec<(String, Yaml)>),
}

impl Yaml {
    /// Reads a document, and numbers as rcl does: infinite ones too.
    ///
    /// # Errors
    /// What is wrong, in a line.
    pub fn read(text: &str) -> Result<Self, String> {
        let mut options = Options::default();
        options.non_finite_float_policy = NonFiniteFloatPolicy::PassThrough;
        serde_saphyr::from_str_with_options(text, options).map_err(|why| one_line(&why))
    }

    pub fn integer(&self) -> Option<i64> {
        if let Self::Integer(value) = self { Some(*value) } else { None }
    }

    pub fn double(&self) -> Option<f64> {
        match self {
            Self::Double(value) => Some(*value),
            other => other.integer().map(|value| value as f64),
        }
    }

    pub fn string(&self) -> Option<String> {
        if let Self::String(value) = self { Some(value.clone()) } else { None }
    }
}

/// The first line of an error's text, without the word "error" and what programmers may do: an operator reads one line.
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
                Ok(Yaml::Null)
            }
            fn visit_none<E>(self) -> Result<Yaml, E> {
                Ok(Yaml::Null)
            }
            fn visit_some<D: Deserializer<'de>>(self, deserializer: D) -> Result<Yaml, D::Error> {
                Yaml::deserialize(deserializer)
            }
            fn visit_bool<E>(self, value: bool) -> Result<Yaml, E> {
                Ok(Yaml::Bool(value))
            }
            fn visit_i64<E>(self, value: i64) -> Result<Yaml, E> {
                Ok(Yaml::Integer(value))
            }
            /// A double, as one below the least integer is.
            fn visit_u64<E>(self, value: u64) -> Result<Yaml, E> {
                Ok(i64::try_from(value).map_or(Yaml::Double(value as f64), Yaml::Integer))
            }
            fn visit_f64<E>(self, value: f64) -> Result<Yaml, E> {
                Ok(Yaml::Double(value))
            }
            fn visit_str<E>(self, value: &str) -> Result<Yaml, E> {
                Ok(Yaml::String(value.to_owned()))
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<Yaml, A::Error> {
                let mut list = Vec::new();
                while let Some(item) = items.next_element()? {
                    list.push(item);
                }
                Ok(Yaml::List(list))
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
