//! The numbers of the reference work, and the arm they belong to.

use dq_config::{DualParameters, NodeParameters, ServoParameters};
use dq_core::servo::Settings;
use dq_kinematics::arm::Chain;
use serde_json::Value;
use std::sync::LazyLock;

/// Read once: laws are integrated through these functions.
static JSON: LazyLock<Value> =
    LazyLock::new(|| serde_json::from_str(include_str!("../../../tests/data/reference.json")).unwrap());
static PARAMETERS: LazyLock<ServoParameters> = LazyLock::new(built_in);

pub fn json() -> &'static Value {
    &JSON
}

pub fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

/// Rows of a matrix given as a list of lists.
pub fn rows(value: &Value) -> Vec<Vec<f64>> {
    value.as_array().unwrap().iter().map(numbers).collect()
}

fn built_in<P: NodeParameters>() -> P {
    let (store, _) = P::start("/any", Vec::new()).unwrap();
    P::from_store(&store).unwrap()
}

pub fn parameters() -> ServoParameters {
    PARAMETERS.clone()
}

pub fn dual_parameters() -> ServoParameters {
    built_in::<DualParameters>().0
}

pub fn puma() -> Chain {
    PARAMETERS.arms.chain().clone()
}

pub fn settings() -> Settings {
    PARAMETERS.settings.clone()
}

/// Largest difference between two lists of the same length.
pub fn distance(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max)
}
