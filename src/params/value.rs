//! Values of ROS 2 parameters.

use serde::{Deserialize, Serialize, Serializer};
use serde_saphyr::{DoubleQuoted, FlowSeq};
use std::fmt;

/// The value of a parameter, of one of the nine ROS 2 types.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Value {
    /// `boolean`
    Bool(bool),
    /// `integer`
    Integer(i64),
    /// `double`
    Double(f64),
    /// `string`
    String(String),
    /// `byte_array`
    ByteArray(Vec<u8>),
    /// `boolean_array`
    BoolArray(Vec<bool>),
    /// `integer_array`
    IntegerArray(Vec<i64>),
    /// `double_array`
    DoubleArray(Vec<f64>),
    /// `string_array`
    StringArray(Vec<String>),
}

impl Value {
    /// Returns the name of the type as `ros2 param describe` prints it.
    pub fn type_name(&self) -> &'static str {
        match self {
            Self::Bool(_) => "boolean",
            Self::Integer(_) => "integer",
            Self::Double(_) => "double",
            Self::String(_) => "string",
            Self::ByteArray(_) => "byte array",
            Self::BoolArray(_) => "boolean array",
            Self::IntegerArray(_) => "integer array",
            Self::DoubleArray(_) => "double array",
            Self::StringArray(_) => "string array",
        }
    }

    /// Converts this value to the type of `like`. Integers become doubles, and an empty array becomes an empty array of that type.
    /// rclcpp, in contrast, rejects an integer for a double, so that users must write `1.0`.
    ///
    /// # Errors
    /// Returns this value unchanged if it cannot be converted.
    pub fn convert_like(self, like: &Self) -> Result<Self, Self> {
        match (self, like) {
            (Self::Integer(i), Self::Double(_)) => Ok(Self::Double(i as f64)),
            (Self::IntegerArray(list), Self::DoubleArray(_)) => {
                Ok(Self::DoubleArray(list.into_iter().map(|i| i as f64).collect()))
            }
            (value, like) if std::mem::discriminant(&value) == std::mem::discriminant(like) => Ok(value),
            (value, like) => match like.emptied() {
                Some(empty) if value.emptied().as_ref() == Some(&value) => Ok(empty),
                _ => Err(value),
            },
        }
    }

    /// Returns an empty array of the same type; `None` for a scalar.
    fn emptied(&self) -> Option<Self> {
        match self {
            Self::ByteArray(_) => Some(Self::ByteArray(Vec::new())),
            Self::BoolArray(_) => Some(Self::BoolArray(Vec::new())),
            Self::IntegerArray(_) => Some(Self::IntegerArray(Vec::new())),
            Self::DoubleArray(_) => Some(Self::DoubleArray(Vec::new())),
            Self::StringArray(_) => Some(Self::StringArray(Vec::new())),
            Self::Bool(_) | Self::Integer(_) | Self::Double(_) | Self::String(_) => None,
        }
    }
}

/// Writes a value as one line of YAML 1.1 that PyYAML can read. In a number with an exponent, PyYAML requires a decimal point and a
/// signed exponent, as in `1.0e+16`.
fn yaml(value: impl Serialize) -> Result<String, fmt::Error> {
    let text = serde_saphyr::to_string(&value).map_err(|_| fmt::Error)?;
    Ok(text.trim_end_matches('\n').to_owned())
}

/// A string to write as YAML: without quotes if every ROS 2 tool reads the unquoted string as a string, otherwise in double quotes.
struct Text<'a>(&'a String);

impl Serialize for Text<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Self(text) = self;
        let is_word = text.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"_./".contains(&byte))
            && text.starts_with(|first: char| first.is_ascii_alphabetic() || first == '/');
        // rcl, like C, reads `infinity` as a number. The serializer itself quotes all other words that could be read as another
        // type.
        match is_word && !text.eq_ignore_ascii_case("infinity") {
            true => serializer.serialize_str(text),
            false => DoubleQuoted(text.as_str()).serialize(serializer),
        }
    }
}

/// Returns the indefinite article for `noun`: "a" or "an".
pub(super) fn article(noun: &str) -> &'static str {
    if noun.starts_with(['a', 'e', 'i', 'o', 'u']) { "an" } else { "a" }
}

/// Writes YAML that reads back as the same value. Bytes read back as integers, because YAML does not have bytes.
impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let text = match self {
            Self::Bool(value) => yaml(value),
            Self::Integer(value) => yaml(value),
            Self::Double(value) => yaml(value),
            Self::String(text) => yaml(Text(text)),
            Self::ByteArray(list) => yaml(FlowSeq(list)),
            Self::BoolArray(list) => yaml(FlowSeq(list)),
            Self::IntegerArray(list) => yaml(FlowSeq(list)),
            Self::DoubleArray(list) => yaml(FlowSeq(list)),
            Self::StringArray(list) => yaml(FlowSeq(list.iter().map(Text).collect::<Vec<_>>())),
        };
        f.write_str(&text?)
    }
}

/// Returns the value in one line. Control characters are escaped.
pub(super) fn visible(value: &impl fmt::Display) -> String {
    let mut text = String::new();
    for character in value.to_string().chars() {
        match character.is_control() {
            true => text.extend(character.escape_default()),
            false => text.push(character),
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn yaml_gives_the_same_types_as_ros_2() {
        let cases = [
            ("true", Value::Bool(true)),
            ("42", Value::Integer(42)),
            ("-1.5", Value::Double(-1.5)),
            ("1e3", Value::Double(1000.0)),
            ("logc", Value::String("logc".into())),
            ("\"42\"", Value::String("42".into())),
            ("[1, 2]", Value::IntegerArray(vec![1, 2])),
            ("[1, 2.5]", Value::DoubleArray(vec![1.0, 2.5])),
            ("[a, b]", Value::StringArray(vec!["a".into(), "b".into()])),
            ("[true, false]", Value::BoolArray(vec![true, false])),
            // ROS 2 supports the tags of YAML from Lyrical on.
            ("!!float 10", Value::Double(10.0)),
            ("!!float .inf", Value::Double(f64::INFINITY)),
            ("!!str true", Value::String("true".into())),
            ("!!str", Value::String("".into())),
            ("!!int 0", Value::Integer(0)),
            ("!!int '-7'", Value::Integer(-7)),
            ("!!bool yes", Value::Bool(true)),
            ("!!bool 'off'", Value::Bool(false)),
            ("!!seq [1, 2]", Value::IntegerArray(vec![1, 2])),
            ("[!!float 1, 2]", Value::DoubleArray(vec![1.0, 2.0])),
            ("[!!str 1, a]", Value::StringArray(vec!["1".into(), "a".into()])),
        ];
        for (text, expected) in cases {
            assert_eq!(Value::from_yaml(text), Ok(expected), "{text}");
        }
        for text in [
            "",
            "[1, a]",
            "{a: 1}",
            "[",
            "99999999999999999999999",
            "!!int x",
            "!!float x",
            "[[1]]",
            "[~]",
            "!!bool 3",
        ] {
            let result = Value::from_yaml(text);
            assert!(!matches!(result, Ok(Value::Integer(_))), "{text} gave {result:?}");
        }
    }

    #[test]
    fn integers_convert_to_doubles_and_an_empty_list_to_any_list() {
        assert_eq!(Value::Integer(2).convert_like(&Value::Double(0.0)), Ok(Value::Double(2.0)));
        let empty = Value::from_yaml("[]").unwrap();
        assert_eq!(empty.convert_like(&Value::DoubleArray(vec![1.0])), Ok(Value::DoubleArray(vec![])));
        assert!(Value::Double(2.0).convert_like(&Value::Integer(0)).is_err());
        assert!(Value::String("1".into()).convert_like(&Value::Double(0.0)).is_err());
    }

    #[test]
    fn strings_that_look_like_another_type_are_quoted() {
        for text in [
            "", "true", "no", "~", "null", "42", "1e3", ".inf", "0x1f", "1:30", "a: b", "a, b", "[", "# x",
            "-", "a\nb", "é", "=", "<<",
        ] {
            let value = Value::String(text.to_owned());
            assert_eq!(Value::from_yaml(&value.to_string()), Ok(value.clone()), "{value}");
            assert!(!value.to_string().contains('\n'));
        }
        assert_eq!(Value::String("double_geodesic".into()).to_string(), "double_geodesic");
        assert_eq!(Value::StringArray(vec!["a b".into(), "c".into()]).to_string(), "[\"a b\", c]");
    }

    /// PyYAML, which `ros2 param load` uses, reads an exponent only with a decimal point and a sign. rcl accepts the same words
    /// for numbers as C does, such as `inf` and `nan`.
    #[test]
    fn numbers_and_words_are_written_so_that_ros_2_tools_read_them() {
        let numbers = [(1e-6, "1.0e-6"), (1.5e-7, "1.5e-7"), (1e16, "1.0e+16"), (-2.5e300, "-2.5e+300")];
        for (value, text) in
            numbers.into_iter().chain([(0.5, "0.5"), (3.0, "3.0"), (1e15, "1000000000000000.0")])
        {
            assert_eq!(Value::Double(value).to_string(), text);
            assert_eq!(Value::from_yaml(text), Ok(Value::Double(value)));
        }
        for word in ["inf", "Infinity", "nan", "NAN"] {
            assert_eq!(Value::String(word.to_owned()).to_string(), format!("\"{word}\""));
        }
    }

    proptest! {
        #[test]
        fn no_text_panics(text in ".{0,60}") {
            let _ = Value::from_yaml(&text);
        }

        #[test]
        fn every_finite_double_reads_back_unchanged(value in any::<f64>().prop_filter("finite", |x| x.is_finite())) {
            prop_assert_eq!(Value::from_yaml(&Value::Double(value).to_string()), Ok(Value::Double(value)));
            let list = Value::DoubleArray(vec![value, 1.0]);
            prop_assert_eq!(Value::from_yaml(&list.to_string()), Ok(list));
        }

        #[test]
        fn every_string_reads_back_unchanged(texts in proptest::collection::vec(any::<String>(), 1..4)) {
            let value = Value::String(texts[0].clone());
            prop_assert_eq!(Value::from_yaml(&value.to_string()), Ok(value));
            let list = Value::StringArray(texts);
            prop_assert_eq!(Value::from_yaml(&list.to_string()), Ok(list));
        }
    }
}
