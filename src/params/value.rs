//! Values of ROS 2 parameters.

use super::ParameterError;
use serde::de::{Deserialize, Deserializer, MapAccess, SeqAccess, Visitor};
use serde_saphyr::{NonFiniteFloatPolicy, Options};
use std::fmt;

/// One of the nine types that a ROS 2 parameter can have.
#[derive(Clone, Debug, PartialEq)]
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
    /// The value that `text` has in YAML, as `ros2 param set` and `-p name:=text` read it.
    ///
    /// # Errors
    /// [`ParameterError::NotAValue`].
    pub fn from_yaml(text: &str) -> Result<Self, ParameterError> {
        let error = |why: String| ParameterError::NotAValue { text: text.to_owned(), why };
        Self::try_from(Yaml::read(text).map_err(error)?).map_err(error)
    }

    /// The type's name, as `ros2 param describe` prints it.
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

    /// This value as one of the type of `like`, if it can be taken for one: integers for doubles, and an empty array
    /// for any array. rclcpp refuses an integer for a double, and makes people write `1.0`.
    pub fn convert_like(self, like: &Self) -> Result<Self, Self> {
        match (self, like) {
            (Self::Integer(i), Self::Double(_)) => Ok(Self::Double(i as f64)),
            (Self::IntegerArray(list), Self::DoubleArray(_)) => {
                Ok(Self::DoubleArray(list.into_iter().map(|i| i as f64).collect()))
            }
            (value, like) if value.is_empty_array() && like.is_array() => Ok(like.cleared()),
            (value, like) if std::mem::discriminant(&value) == std::mem::discriminant(like) => Ok(value),
            (value, _) => Err(value),
        }
    }

    fn is_array(&self) -> bool {
        !matches!(self, Self::Bool(_) | Self::Integer(_) | Self::Double(_) | Self::String(_))
    }

    fn is_empty_array(&self) -> bool {
        self.is_array() && *self == self.cleared()
    }

    /// An empty array of the same type; a scalar as it is.
    fn cleared(&self) -> Self {
        match self {
            Self::ByteArray(_) => Self::ByteArray(Vec::new()),
            Self::BoolArray(_) => Self::BoolArray(Vec::new()),
            Self::IntegerArray(_) => Self::IntegerArray(Vec::new()),
            Self::DoubleArray(_) => Self::DoubleArray(Vec::new()),
            Self::StringArray(_) => Self::StringArray(Vec::new()),
            scalar => scalar.clone(),
        }
    }
}

fn joined<T>(list: &[T], print: impl Fn(&T) -> String) -> String {
    list.iter().map(print).collect::<Vec<_>>().join(", ")
}

/// An exponent has its sign, and a point before it: without them YAML 1.1, as PyYAML reads it, has a text there.
fn yaml_double(value: f64) -> String {
    let digits = format!("{value:?}");
    match digits.split_once('e') {
        _ if value.is_nan() => ".nan".to_owned(),
        _ if value.is_infinite() => if value > 0.0 { ".inf" } else { "-.inf" }.to_owned(),
        None => digits,
        Some((mantissa, exponent)) => {
            let point = if mantissa.contains('.') { "" } else { ".0" };
            let sign = if exponent.starts_with('-') { "" } else { "+" };
            format!("{mantissa}{point}e{sign}{exponent}")
        }
    }
}

/// The text bare where YAML reads it so, in a list too; else in double quotes.
fn yaml_string(text: &str) -> String {
    // ROS 2 reads these as booleans, as YAML 1.1 did, or as numbers, as C does.
    const OTHERS: [&str; 9] = ["y", "n", "yes", "no", "on", "off", "inf", "infinity", "nan"];
    let bare = |byte: u8| byte.is_ascii_alphanumeric() || b"_./".contains(&byte);
    let read = Yaml::read(text).ok();
    let begins_as_a_word = text.starts_with(|c: char| c.is_ascii_alphabetic() || c == '/');
    let is_other = OTHERS.iter().any(|word| text.eq_ignore_ascii_case(word));
    if begins_as_a_word && !is_other && text.bytes().all(bare) && read == Some(Yaml::String(text.to_owned()))
    {
        return text.to_owned();
    }
    let mut quoted = String::from('"');
    for character in text.chars() {
        match character {
            '"' | '\\' => quoted.extend(['\\', character]),
            ' ' => quoted.push(character),
            _ if character.is_control() || character.is_whitespace() || character == '\u{feff}' => {
                quoted.push_str(&format!("\\U{:08x}", u32::from(character)));
            }
            _ => quoted.push(character),
        }
    }
    quoted + "\""
}

/// "a" or "an", as it stands before `noun`.
pub(super) fn article(noun: &str) -> &'static str {
    if noun.starts_with(['a', 'e', 'i', 'o', 'u']) { "an" } else { "a" }
}

/// As YAML that reads back as the same value; but bytes, which YAML does not have, read back as integers.
impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bool(value) => write!(f, "{value}"),
            Self::Integer(value) => write!(f, "{value}"),
            Self::Double(value) => f.write_str(&yaml_double(*value)),
            Self::String(value) => f.write_str(&yaml_string(value)),
            Self::ByteArray(list) => write!(f, "{list:?}"),
            Self::BoolArray(list) => write!(f, "{list:?}"),
            Self::IntegerArray(list) => write!(f, "{list:?}"),
            Self::DoubleArray(list) => write!(f, "[{}]", joined(list, |value| yaml_double(*value))),
            Self::StringArray(list) => write!(f, "[{}]", joined(list, |value| yaml_string(value))),
        }
    }
}

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

    fn integer(&self) -> Option<i64> {
        if let Self::Integer(value) = self { Some(*value) } else { None }
    }

    fn double(&self) -> Option<f64> {
        match self {
            Self::Double(value) => Some(*value),
            other => other.integer().map(|value| value as f64),
        }
    }

    fn string(&self) -> Option<String> {
        if let Self::String(value) = self { Some(value.clone()) } else { None }
    }
}

/// The first line of an error's text, without the word "error" and what programmers may do: an operator reads one line.
pub(crate) fn one_line(error: &impl fmt::Display) -> String {
    const TO_PROGRAMMERS: [&str; 2] = [", set DuplicateKeyPolicy", "; use from_str"];
    let text = error.to_string();
    let line = text.lines().next().unwrap_or_default().trim_start_matches("error:").trim();
    TO_PROGRAMMERS.iter().fold(line, |line, words| line.split(words).next().unwrap_or(line)).to_owned()
}

/// What is printed, with line ends and other control characters as escapes.
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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn yaml_gives_the_types_that_ros_2_gives() {
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
        ];
        for (text, expected) in cases {
            assert_eq!(Value::from_yaml(text), Ok(expected), "{text}");
        }
        for text in ["", "[1, a]", "{a: 1}", "[", "99999999999999999999999"] {
            let result = Value::from_yaml(text);
            assert!(!matches!(result, Ok(Value::Integer(_))), "{text} gave {result:?}");
        }
    }

    #[test]
    fn integers_are_taken_for_doubles_and_an_empty_list_for_any() {
        assert_eq!(Value::Integer(2).convert_like(&Value::Double(0.0)), Ok(Value::Double(2.0)));
        let empty = Value::from_yaml("[]").unwrap();
        assert_eq!(empty.convert_like(&Value::DoubleArray(vec![1.0])), Ok(Value::DoubleArray(vec![])));
        assert!(Value::Double(2.0).convert_like(&Value::Integer(0)).is_err());
        assert!(Value::String("1".into()).convert_like(&Value::Double(0.0)).is_err());
    }

    #[test]
    fn strings_that_look_like_something_else_are_quoted() {
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

    /// PyYAML, with which `ros2 param load` reads, takes exponents with point and sign alone; rcl takes the words of C for numbers.
    #[test]
    fn numbers_and_words_are_written_as_the_tools_of_ros_2_read_them() {
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
        fn every_finite_double_reads_back_as_it_was(value in any::<f64>().prop_filter("finite", |x| x.is_finite())) {
            prop_assert_eq!(Value::from_yaml(&Value::Double(value).to_string()), Ok(Value::Double(value)));
            let list = Value::DoubleArray(vec![value, 1.0]);
            prop_assert_eq!(Value::from_yaml(&list.to_string()), Ok(list));
        }

        #[test]
        fn every_string_reads_back_as_it_was(texts in proptest::collection::vec(any::<String>(), 1..4)) {
            let value = Value::String(texts[0].clone());
            prop_assert_eq!(Value::from_yaml(&value.to_string()), Ok(value));
            let list = Value::StringArray(texts);
            prop_assert_eq!(Value::from_yaml(&list.to_string()), Ok(list));
        }
    }
}
