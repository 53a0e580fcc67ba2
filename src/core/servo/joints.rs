//! Joint states matched by name.

use super::Rejection;
use dq_common::text::cut;
use dq_kinematics::arm::bounds;
use std::sync::Arc;

/// The arm's joint names, in the arm's order.
#[derive(Clone, Debug, PartialEq)]
pub struct JointOrder {
    names: Arc<[String]>,
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
    /// A [`Rejection`] where a joint is missing, a number is not finite or the lists do not fit.
    pub(super) fn locate(
        &self,
        names: &[String],
        positions: &[f64],
        places: &mut [usize],
    ) -> Result<(), Rejection> {
        if names.len() != positions.len() {
            return Err(Rejection::WrongLength { names: names.len(), positions: positions.len() });
        }
        for (joint, place) in self.names.iter().zip(places) {
            if names.get(*place) != Some(joint) {
                *place = names.iter().position(|name| name == joint).ok_or_else(|| missing(joint, names))?;
            }
            let value = positions[*place];
            check(joint, value)?;
        }
        Ok(())
    }

    /// Writes the positions \[rad\] of the arm's joints to `into`, matched by name; other joints are ignored.
    ///
    /// # Errors
    /// A [`Rejection`] where a joint is missing, a number is not finite or beyond [`bounds`], or the lists do not fit; `into` is then unchanged.
    pub fn positions(&self, names: &[String], positions: &[f64], into: &mut [f64]) -> Result<(), Rejection> {
        let mut places = vec![0; self.names.len()];
        self.locate(names, positions, &mut places)?;
        for (slot, place) in into.iter_mut().zip(places) {
            *slot = positions[place];
        }
        Ok(())
    }
}

pub(super) fn check(joint: &str, value: f64) -> Result<(), Rejection> {
    let (field, bound) = (|| format!("position of {joint:?}"), bounds::JOINT_ANGLE);
    match value {
        value if value.abs() <= bound => Ok(()),
        value if value.is_finite() => {
            Err(Rejection::OutOfRange { field: field(), value, bound, unit: "rad or m" })
        }
        value => Err(Rejection::NonFinite { field: field(), value }),
    }
}

pub(super) fn missing(joint: &str, names: &[String]) -> Rejection {
    let names = names.iter().take(8).map(|name| cut(name).into_owned()).collect();
    Rejection::MissingJoint { joint: joint.to_owned(), names }
}
