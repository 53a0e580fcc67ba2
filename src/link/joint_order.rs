//! Matches joint states by joint name.

use crate::StateError;
use dq_kinematics::arm::bounds::{self, NumberError};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// The arm's joint names, in the arm's order.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "Vec<String>", into = "Vec<String>")]
pub struct JointOrder {
    names: Arc<[String]>,
}

impl From<Vec<String>> for JointOrder {
    fn from(names: Vec<String>) -> Self {
        Self::new(names)
    }
}

impl From<JointOrder> for Vec<String> {
    fn from(order: JointOrder) -> Self {
        order.names.to_vec()
    }
}

impl JointOrder {
    /// Creates the order from the joint names, base first.
    pub fn new(names: Vec<String>) -> Self {
        Self { names: names.into() }
    }

    /// Returns the names, base first.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Returns whether at least one of the arm's joints is among `names`. A message without these joints is about something else.
    pub fn has_any_of(&self, names: &[String]) -> bool {
        self.names.iter().any(|joint| names.contains(joint))
    }

    /// Finds the arm's joints in a message by name, and ignores other joints. Sets `places` to the index of each joint in the
    /// message. First tries the indices that `places` contains from the previous message.
    ///
    /// # Errors
    /// A [`StateError`] if a joint is missing, a number is not finite or beyond [`bounds`], or the lists have different lengths.
    pub(crate) fn locate(
        &self,
        names: &[String],
        positions: &[f64],
        places: &mut [usize],
    ) -> Result<(), StateError> {
        if names.len() != positions.len() {
            return Err(StateError::WrongLength { names: names.len(), positions: positions.len() });
        }
        for (joint, place) in self.names.iter().zip(places) {
            if names.get(*place) != Some(joint) {
                *place = names
                    .iter()
                    .position(|name| name == joint)
                    .ok_or_else(|| StateError::missing(joint, names))?;
            }
            let value = positions[*place];
            check(joint, value)?;
        }
        Ok(())
    }

    /// Sets `into` to the positions \[rad, prismatic: m\] of the arm's joints, matched by name. Ignores other joints.
    ///
    /// # Errors
    /// A [`StateError`] if a joint is missing, a number is not finite or beyond [`bounds`], or the lists have different lengths.
    /// `into` is then unchanged.
    pub fn positions(&self, names: &[String], positions: &[f64], into: &mut [f64]) -> Result<(), StateError> {
        let mut places = vec![0; self.names.len()];
        self.locate(names, positions, &mut places)?;
        for (slot, place) in into.iter_mut().zip(places) {
            *slot = positions[place];
        }
        Ok(())
    }
}

/// Checks that the position \[rad, prismatic: m\] of a joint is finite and within [`bounds::JOINT_ANGLE`].
pub(crate) fn check(joint: &str, position: f64) -> Result<(), NumberError> {
    bounds::check(|| format!("position of {joint:?}"), &[position], bounds::JOINT_ANGLE, "rad or m")
}
