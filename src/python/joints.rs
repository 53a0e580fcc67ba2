//! Joint goals from Python.

use super::arrays::{Numbers, slice, wrong};
use pyo3::prelude::*;
use std::collections::HashMap;

/// A joint goal from Python \[rad, prismatic: m\]: a dict of positions by joint name, or a list with the position of every joint.
#[derive(FromPyObject)]
pub(super) enum JointGoal<'py> {
    Named(HashMap<String, f64>),
    All(Numbers<'py>),
}

impl JointGoal<'_> {
    /// Returns the goals of all joints, in the order of their names in `joints`. A joint that the goal does not name gets `None`.
    pub fn positions(&self, joints: &[String]) -> PyResult<Vec<Option<f64>>> {
        let named = match self {
            JointGoal::All(positions) => return Ok(slice(positions).iter().copied().map(Some).collect()),
            JointGoal::Named(named) => named,
        };
        if let Some(name) = named.keys().find(|name| !joints.contains(name)) {
            return Err(wrong(format!("{name:?} is not a joint, expected {}", joints.join(", "))));
        }
        Ok(joints.iter().map(|name| named.get(name).copied()).collect())
    }
}
