//! Parameters by their ROS names, converted from and to Python.

use super::arrays::wrong;
use super::law::Law;
use dq_config::{DualParameters, NodeParameters, ServoParameters, SetupError, arm_file};
use dq_params::{ParameterError, ParameterOverride, ParameterStore, Value, parameters_for};
use dq_wire::ServoKind;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// The value of a parameter from Python. The first variant that matches counts: `True` becomes a bool, not an integer, and `1` becomes
/// an integer, not a double.
#[derive(FromPyObject, IntoPyObject)]
pub(super) enum PythonValue {
    Bool(bool),
    Integer(i64),
    Double(f64),
    Text(String),
    Bools(Vec<bool>),
    Integers(Vec<i64>),
    Doubles(Vec<f64>),
    Texts(Vec<String>),
}

impl From<PythonValue> for Value {
    fn from(value: PythonValue) -> Self {
        match value {
            PythonValue::Bool(it) => Self::Bool(it),
            PythonValue::Integer(it) => Self::Integer(it),
            PythonValue::Double(it) => Self::Double(it),
            PythonValue::Text(it) => Self::String(it),
            PythonValue::Bools(it) => Self::BoolArray(it),
            PythonValue::Integers(it) => Self::IntegerArray(it),
            PythonValue::Doubles(it) => Self::DoubleArray(it),
            PythonValue::Texts(it) => Self::StringArray(it),
        }
    }
}

impl From<Value> for PythonValue {
    fn from(value: Value) -> Self {
        match value {
            Value::Bool(it) => Self::Bool(it),
            Value::Integer(it) => Self::Integer(it),
            Value::Double(it) => Self::Double(it),
            Value::String(it) => Self::Text(it),
            Value::ByteArray(it) => Self::Integers(it.into_iter().map(i64::from).collect()),
            Value::BoolArray(it) => Self::Bools(it),
            Value::IntegerArray(it) => Self::Integers(it),
            Value::DoubleArray(it) => Self::Doubles(it),
            Value::StringArray(it) => Self::Texts(it),
        }
    }
}

/// Returns the names and values of a dict; an empty list for `None`.
pub(super) fn values(given: Option<&Bound<'_, PyDict>>) -> PyResult<Vec<(String, Value)>> {
    let pair = |(name, value): (Bound<'_, PyAny>, Bound<'_, PyAny>)| {
        let name: String = name.extract()?;
        let value: PythonValue = value
            .extract()
            .map_err(|_| wrong(format!("parameter {name:?} has no value of a parameter: {value}")))?;
        Ok((name, value.into()))
    };
    given.into_iter().flat_map(|given| given.iter()).map(pair).collect()
}

/// Returns the parameter store of a servo for `arm`, a built-in arm or a parameter file, with the additional `values`.
pub(super) fn store(
    py: Python<'_>,
    kind: ServoKind,
    arm: Option<&str>,
    values: Vec<(String, Value)>,
) -> PyResult<ParameterStore> {
    // A parameter file has the node's parameters under its ROS name.
    let node = format!("/{}", kind.node_name());
    let of = |values: Vec<(String, Value)>, source: &str, by_name| {
        let source = source.to_owned();
        values.into_iter().map(move |(name, value)| ParameterOverride {
            name,
            value,
            source: source.clone(),
            by_name,
        })
    };
    let mut given: Vec<_> = match arm {
        Some(arm) => of(of_arm(&node, arm)?, arm, false).collect(),
        None => Vec::new(),
    };
    let names: Vec<_> = values.iter().map(|(name, _)| name.clone()).collect();
    given.extend(of(values, "parameters", true));
    let started = match kind {
        ServoKind::OneArm => ServoParameters::start(&node, given),
        ServoKind::TwoArms => DualParameters::start(&node, given),
    };
    let (store, warnings) = started.map_err(wrong)?;
    if let Some(name) = names.iter().find(|name| store.get(name).is_none()) {
        return Err(wrong(format!("{node} has no parameter {name:?}: it is another node's")));
    }
    for warning in warnings {
        warn(py, &warning)?;
    }
    Ok(store)
}

fn of_arm(node: &str, arm: &str) -> PyResult<Vec<(String, Value)>> {
    let text = match (arm_file(arm), std::fs::read_to_string(arm)) {
        (Some((_, text)), _) => text.to_owned(),
        (None, Ok(text)) => text,
        (None, Err(_)) => return Err(wrong(SetupError::UnknownArm(arm.to_owned()))),
    };
    parameters_for(&text, arm, node).map_err(wrong)
}

/// Returns the typed parameters. Warns about keep-outs that are not checked.
pub(super) fn typed(py: Python<'_>, kind: ServoKind, store: &ParameterStore) -> PyResult<ServoParameters> {
    let parameters = kind.from_store(store).map_err(wrong)?;
    if parameters.idle_keep_outs > 0 {
        warn(py, "constraints is false: the arm ignores keep_out and keep_in")?;
    }
    Ok(parameters)
}

/// Returns the parameters that select a law of the library, with its gains and its aim.
pub(super) fn of_law(law: &Law) -> Vec<(String, Value)> {
    let controller = &law.controller;
    let (name, gains) = (controller.law.parameter().to_owned(), law.gains());
    let gains = match *gains.as_slice() {
        [gain] => Value::Double(gain),
        _ => Value::DoubleArray(gains),
    };
    let [law, task] =
        [controller.law.name(), controller.aim.name()].map(|name| Value::String(name.to_owned()));
    vec![("controller".to_owned(), law), ("task".to_owned(), task), (name, gains)]
}

/// Returns a copy of the store with these changes.
pub(super) fn changed(store: &ParameterStore, changes: &[(String, Value)]) -> Result<ParameterStore, PyErr> {
    store.with(changes).map_err(|why: ParameterError| wrong(why))
}

fn warn(py: Python<'_>, text: &str) -> PyResult<()> {
    let text = std::ffi::CString::new(text).map_err(wrong)?;
    PyErr::warn(py, &py.get_type::<pyo3::exceptions::PyUserWarning>(), &text, 1)
}
