//! The numbers of the reference work, and the arm they belong to.

use dq_servo::arm::Chain;
use dq_servo::config::{BUILTIN_FILE, DualParameters, NodeParameters, ServoParameters};
use dq_servo::control::Controller;
use dq_servo::params::parameters_for;
use dq_servo::servo::Settings;
use serde_json::Value;

pub fn json() -> Value {
    serde_json::from_str(include_str!("../data/reference.json")).unwrap()
}

pub fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

/// Rows of a matrix given as a list of lists.
pub fn rows(value: &Value) -> Vec<Vec<f64>> {
    value.as_array().unwrap().iter().map(numbers).collect()
}

fn built_in<P: NodeParameters>() -> P {
    let mut store = P::store();
    for (name, value) in parameters_for(BUILTIN_FILE, "puma560.yaml", "/any").unwrap() {
        store.override_initial(&name, value).unwrap();
    }
    P::from_store(&store).unwrap()
}

pub fn parameters() -> ServoParameters {
    built_in()
}

pub fn dual_parameters() -> DualParameters {
    built_in()
}

pub fn puma() -> Chain {
    parameters().task.chain().clone()
}

pub fn settings() -> Settings<Controller> {
    parameters().settings
}

/// Largest difference between two lists of the same length.
pub fn distance(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max)
}
