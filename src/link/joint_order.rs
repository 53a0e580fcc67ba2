//! Joint states matched by name.

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
    /// From the joint names, base first.
    pub fn new(names: Vec<String>) -> Self {
        Self { names: names.into() }
    }

    /// The names, base first.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Whether one of the arm's joints is among `names`: what a message without them says is of something else.
    pub fn has_any_of(&self, names: &[String]) -> bool {
        self.names.iter().any(|joint| names.contains(joint))
    }

    /// Finds the arm's joints in a message, by name; other joints are ignored. `places`, one a joint, are where they were in the
    /// message before, and then where they are in this one.
    ///
    /// # Errors
    /// A [`StateError`] where a joint is missing, a number is not finite or the lists do not fit.
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

    /// Writes the positions \[rad\] of the arm's joints to `into`, matched by name; other joints are ignored.
    ///
    /// # Errors
    /// A [`StateError`] where a joint is missing, a number is not finite or beyond [`bounds`], or the lists do not fit; `into` is then unchanged.
    pub fn positions(&self, names: &[String], positions: &[f64], into: &mut [f64]) -> Result<(), StateError> {
        let mut places = vec![0; self.names.len()];
        self.locate(names, positions, &mut places)?;
        for (slot, place) in into.iter_mut().zip(places) {
            *slot = positions[place];
        }
        Ok(())
    }
}

/// Checks the position \[rad, prismatic: m\] of a joint.
pub(crate) fn check(joint: &str, position: f64) -> Result<(), NumberError> {
    bounds::check(|| format!("position of {joint:?}"), &[position], bounds::JOINT_ANGLE, "rad or m")
}
