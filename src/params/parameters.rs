//! Structs whose fields are parameters.

use super::{Declaration, ParameterError, Value};
use std::collections::HashMap;
use std::str::FromStr;
use std::time::Duration;

/// The parameters of a node, each declared by one field: `#[derive(Parameters)]`.
///
/// The documentation of a field is the parameter's description, and brackets at its end contain the unit. The keywords in
/// `#[parameter(...)]` give the rest:
/// - `default = 0.5`: the default value. Without this keyword, the default is 0, false or empty.
/// - `range = 0.0..=1.0`: the allowed range.
/// - `one_of = NAMES`: the allowed names, for a field whose type is parsed from a name.
/// - `name = "..."`: the parameter's name, if it differs from the field's.
/// - `fixed`: the parameter is read-only while the node runs.
/// - `required`: the user must give a value, because no default would be useful.
/// - `group`: the field is another struct whose parameters are included.
///
/// A field without the attribute is not a parameter. The attribute `#[parameters(prefix = "limits.")]` on the struct adds a prefix to the
/// names of its fields.
///
/// ```
/// use dq_params::{Parameters, ParameterStore, Value};
/// use std::time::Duration;
/// #[derive(Parameters)]
/// #[parameters(prefix = "follow.")]
/// struct Follower {
///     /// how fast the error decays [1/s]
///     #[parameter(default = 0.5, range = 0.0..=10.0)]
///     gain: f64,
///     /// age at which a goal is stale \[s\]
///     #[parameter(default = 2.0, range = 0.0..=60.0, fixed)]
///     timeout: Duration,
/// }
/// let mut store = ParameterStore::of::<Follower>()?;
/// store.override_initial("follow.gain", Value::Integer(2))?;
/// let follower: Follower = store.read()?;
/// assert_eq!((follower.gain, follower.timeout.as_secs()), (2.0, 2));
/// # Ok::<(), dq_params::ParameterError>(())
/// ```
pub trait Parameters: Sized {
    /// Declares and reads each parameter. The declarations must not depend on the parameters' values.
    ///
    /// # Errors
    /// [`ParameterError`] if values contradict each other.
    fn declare(p: &mut Declarer) -> Result<Self, ParameterError>;
}

/// Collects the declarations of a node in order. Returns the value of each parameter when it is declared.
pub struct Declarer {
    values: HashMap<String, Value>,
    declared: Vec<Declaration>,
}

impl Declarer {
    /// Creates a declarer with these values. A parameter for which there is no valid value gets its default.
    pub fn new(values: impl IntoIterator<Item = (String, Value)>) -> Self {
        Self { values: values.into_iter().collect(), declared: Vec::new() }
    }

    /// Returns the declarations, in the order in which the parameters were declared.
    pub fn into_declarations(self) -> Vec<Declaration> {
        self.declared
    }

    /// Declares a parameter and reads its value.
    ///
    /// # Errors
    /// [`ParameterError::Invalid`] if the length of a list does not match the type.
    pub fn read<T: ParameterType>(&mut self, declaration: Declaration) -> Result<T, ParameterError> {
        let given = self.values.get(declaration.name).cloned();
        let fitting = given.and_then(|value| declaration.check(value).ok());
        let value = T::read(declaration.name, fitting.unwrap_or_else(|| declaration.default.clone()));
        self.declared.push(declaration);
        value
    }

    /// Declares a parameter whose value is one of several names, and parses the name.
    ///
    /// # Errors
    /// [`ParameterError::Invalid`] if the name cannot be parsed.
    pub fn read_name<T: FromStr>(&mut self, declaration: Declaration) -> Result<T, ParameterError> {
        let (name, expected) = (declaration.name, declaration.expected());
        let text: String = self.read(declaration)?;
        text.parse().map_err(|_| ParameterError::invalid(name, text, expected))
    }
}

/// A type that the field of a parameter can have.
pub trait ParameterType: Sized {
    /// Returns the default of a field that declares no default: 0, false or empty.
    fn empty() -> Value;

    /// Converts the value of the parameter `name`. The value has the same type as [`empty`](Self::empty).
    ///
    /// # Errors
    /// [`ParameterError`] if the value does not fit the type.
    fn read(name: &'static str, value: Value) -> Result<Self, ParameterError>;
}

macro_rules! types {
    ($($type:ty: $variant:ident,)*) => {$(
        impl From<$type> for Value {
            fn from(value: $type) -> Self {
                Self::$variant(value)
            }
        }

        impl ParameterType for $type {
            fn empty() -> Value {
                Value::$variant(Self::default())
            }

            fn read(name: &'static str, value: Value) -> Result<Self, ParameterError> {
                let expected = Self::empty().type_name();
                match value {
                    Value::$variant(value) => Ok(value),
                    value => Err(ParameterError::WrongType { name, expected, value }),
                }
            }
        }
    )*};
}

types! {
    bool: Bool,
    i64: Integer,
    f64: Double,
    String: String,
    Vec<f64>: DoubleArray,
    Vec<String>: StringArray,
}

impl<const N: usize> From<[f64; N]> for Value {
    fn from(numbers: [f64; N]) -> Self {
        Self::DoubleArray(numbers.into())
    }
}

/// A list of exactly `N` numbers.
impl<const N: usize> ParameterType for [f64; N] {
    fn empty() -> Value {
        Value::from([0.0; N])
    }

    fn read(name: &'static str, value: Value) -> Result<Self, ParameterError> {
        let list = Vec::read(name, value)?;
        exactly(name, &list, N)?;
        Ok(std::array::from_fn(|i| list[i]))
    }
}

/// A time in seconds.
impl ParameterType for Duration {
    fn empty() -> Value {
        f64::empty()
    }

    fn read(name: &'static str, value: Value) -> Result<Self, ParameterError> {
        let seconds = f64::read(name, value)?;
        Self::try_from_secs_f64(seconds)
            .map_err(|why| ParameterError::invalid(name, seconds, why.to_string()))
    }
}

/// A time in seconds; 0 stands for `None`.
impl ParameterType for Option<Duration> {
    fn empty() -> Value {
        f64::empty()
    }

    fn read(name: &'static str, value: Value) -> Result<Self, ParameterError> {
        Duration::read(name, value).map(|time| Some(time).filter(|time| !time.is_zero()))
    }
}

/// Checks that the list of a parameter has `count` elements.
///
/// # Errors
/// [`ParameterError::Invalid`] if the list has another length.
pub fn exactly<T>(name: &'static str, list: &[T], count: usize) -> Result<(), ParameterError> {
    match list.len() {
        length if length == count => Ok(()),
        length => {
            Err(ParameterError::invalid(name, format!("a list of {length}"), format!("{count} numbers")))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ParameterStore, Parameters};

    #[derive(Debug, PartialEq, Parameters)]
    struct Outer {
        /// how often \[Hz\]
        #[parameter(default = 10, range = 1..=100, fixed)]
        rate: i64,
        #[parameter(group)]
        inner: Inner,
        aside: u8,
    }

    #[derive(Debug, PartialEq, Parameters)]
    #[parameters(prefix = "in.")]
    struct Inner {
        /// how fast
        /// it is [1/s]
        #[parameter(default = 0.5, range = 0.0..=1.0)]
        gain: f64,
        /// the mode
        #[parameter(default = "b".to_owned(), one_of = &["a", "b"])]
        mode: String,
        /// how far [m]
        #[parameter(name = "far", range = 0.0..=9.0, required)]
        limits: Vec<f64>,
        /// the joints
        #[parameter()]
        joints: Vec<String>,
        /// two numbers
        #[parameter(default = [1.0, 2.0])]
        pair: [f64; 2],
        /// longest duration \[s\]; 0 means no limit
        #[parameter(range = 0.0..=5.0)]
        time: Option<Duration>,
    }

    #[test]
    fn each_field_declares_and_reads_a_parameter() {
        let mut store = ParameterStore::of::<Outer>().unwrap();
        let declared: Vec<_> = store.iter().map(|(one, _)| (one.name, one.read_only, one.required)).collect();
        let expected = [
            ("rate", true, false),
            ("in.gain", false, false),
            ("in.mode", false, false),
            ("far", false, true),
        ];
        assert_eq!(declared[..4], expected);
        let gain = store.declaration("in.gain").unwrap();
        assert_eq!((gain.description, gain.expected().as_str()), ("how fast it is", "0 to 1 1/s"));
        let inner = Inner {
            gain: 0.5,
            mode: "b".to_owned(),
            limits: vec![],
            joints: vec![],
            pair: [1.0, 2.0],
            time: None,
        };
        let mut all = Outer { rate: 10, inner, aside: 0 };
        assert_eq!(store.read::<Outer>().unwrap(), all);

        store.override_initial("far", Value::IntegerArray(vec![1, 2])).unwrap();
        let changes = [
            ("in.gain", Value::Integer(1)),
            ("in.time", Value::Double(1.5)),
            ("in.mode", Value::from("a".to_owned())),
        ];
        let store = store.with(&changes.map(|(name, value)| (name.to_owned(), value))).unwrap();
        (all.inner.gain, all.inner.limits, all.inner.mode) = (1.0, vec![1.0, 2.0], "a".to_owned());
        all.inner.time = Some(Duration::from_millis(1500));
        assert_eq!(store.read::<Outer>().unwrap(), all);
        let more = store.with(&[("in.pair".to_owned(), Value::from([1.0; 3]))]).unwrap();
        let error = more.read::<Outer>().unwrap_err().to_string();
        assert_eq!(error, "parameter \"in.pair\" cannot be a list of 3: expected 2 numbers");
        assert!(
            store
                .with(&[("in.mode".to_owned(), Value::from("c".to_owned()))])
                .unwrap_err()
                .to_string()
                .contains("one of a, b")
        );
    }

    #[test]
    fn a_read_only_parameter_takes_the_value_that_it_has() {
        let store = ParameterStore::of::<Outer>().unwrap();
        let with = |rate: Value| store.with(&[("rate".to_owned(), rate)]).map_err(|why| why.to_string());
        assert_eq!(with(Value::Integer(10)).unwrap(), store);
        for other in [Value::Integer(11), Value::from("10".to_owned())] {
            assert_eq!(with(other).unwrap_err(), "parameter \"rate\" is read-only while the node runs");
        }
    }
}
