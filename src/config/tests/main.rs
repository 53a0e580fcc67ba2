//! Tests of the nodes' parameters, and of the arms that they describe.

mod body;
mod described;
mod described_limits;
mod lenient;
mod meshes;
mod parameters;
mod setup;
mod two_arms;
mod urdf_1_2;

use dq_config::{NodeParameters, ServoParameters};
use dq_params::{ParameterError, ParameterOverride, ParameterStore, Value};

fn text(text: &str) -> Value {
    Value::String(text.to_owned())
}

fn given(values: &[(&str, Value)]) -> Vec<ParameterOverride> {
    values.iter().map(|(name, value)| ParameterOverride::new(*name, value.clone(), "test")).collect()
}

/// Returns the store of a servo with these parameters, and its warnings.
fn start(values: &[(&str, Value)]) -> Result<(ParameterStore, Vec<String>), ParameterError> {
    ServoParameters::start("/dq_servo", given(values))
}

/// Returns the typed parameters of a servo. The servo must not warn.
fn started(values: &[(&str, Value)]) -> Result<ServoParameters, String> {
    let (store, warnings) = start(values).map_err(|why| why.to_string())?;
    assert_eq!(warnings, [""; 0]);
    ServoParameters::from_store(&store).map_err(|why| why.to_string())
}
