//! The joints of a servo's arms by name.

use super::arrays::{Numbers, slice, wrong};
use dq_core::servo::JointOrder;
use dq_wire::ServoKind;
use pyo3::prelude::*;
use std::collections::HashMap;
use std::ops::Range;

/// The joints of one arm or two, arm after arm.
pub(super) struct Joints {
    /// The joint names of each arm.
    pub arms: Vec<JointOrder>,
    /// All names; those of two arms have the arm as a prefix, such as `left/joint1`.
    pub names: Vec<String>,
}

/// A joint goal from Python \[rad, prismatic: m\]: positions by joint name, or of all joints in their order.
#[derive(FromPyObject)]
pub(super) enum JointGoal<'py> {
    Named(HashMap<String, f64>),
    All(Numbers<'py>),
}

impl Joints {
    pub fn new(kind: ServoKind, arms: Vec<JointOrder>) -> Self {
        let prefixed = |(prefix, arm): (&&str, &JointOrder)| {
            arm.names().iter().map(|name| format!("{prefix}{name}")).collect::<Vec<_>>()
        };
        let names = kind.arms().iter().zip(&arms).flat_map(prefixed).collect();
        Self { arms, names }
    }

    /// Yields the joint names of each arm, and the range of the arm's joints among all.
    pub fn ranges(&self) -> impl Iterator<Item = (&[String], Range<usize>)> {
        self.arms.iter().scan(0, |begin, arm| {
            let range = *begin..*begin + arm.names().len();
            *begin = range.end;
            Some((arm.names(), range))
        })
    }

    /// Returns the position of each joint; `None` for a joint that the goal does not name.
    pub fn positions(&self, goal: &JointGoal<'_>) -> PyResult<Vec<Option<f64>>> {
        let named = match goal {
            JointGoal::All(positions) => return Ok(slice(positions).iter().copied().map(Some).collect()),
            JointGoal::Named(named) => named,
        };
        if let Some(name) = named.keys().find(|name| !self.names.contains(name)) {
            return Err(wrong(format!("{name:?} is not a joint, expected {}", self.names.join(", "))));
        }
        Ok(self.names.iter().map(|name| named.get(name).copied()).collect())
    }
}
