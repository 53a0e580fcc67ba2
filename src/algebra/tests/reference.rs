//! Numbers from the reference work (Sathuluri 2018).

use serde_json::Value;
use std::sync::LazyLock;

/// Numbers from the reference work (Sathuluri 2018). They are parsed only once, because the tests read them often.
static JSON: LazyLock<Value> =
    LazyLock::new(|| serde_json::from_str(include_str!("../../../tests/data/reference.json")).unwrap());

pub fn json() -> &'static Value {
    &JSON
}

pub fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

/// Returns the largest difference between two lists of the same length.
pub fn distance(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max)
}
