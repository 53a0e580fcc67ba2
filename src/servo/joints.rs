//! Joint states matched by name.

use super::Rejection;

/// The arm's joint names, in the arm's order.
#[derive(Clone, Debug, PartialEq)]
pub struct JointOrder {
    names: Vec<String>,
}

impl JointOrder {
    /// From the joint names, base first.
    pub fn new(names: Vec<String>) -> Self {
        Self { names }
    }

    /// The names, base first.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Writes the positions \[rad\] of the arm's joints to `into`, matched by name; other joints are ignored.
    ///
    /// # Errors
    /// A [`Rejection`] where a joint is missing, a number is not finite or the lists do not fit; `into` is then unchanged.
    pub fn positions(&self, names: &[String], positions: &[f64], into: &mut [f64]) -> Result<(), Rejection> {
        if names.len() != positions.len() {
            return Err(Rejection::WrongLength { names: names.len(), positions: positions.len() });
        }
        self.names.iter().try_for_each(|joint| self.find(joint, names, positions).map(drop))?;
        for (joint, slot) in self.names.iter().zip(into) {
            *slot = self.find(joint, names, positions)?;
        }
        Ok(())
    }

    fn find(&self, joint: &str, names: &[String], positions: &[f64]) -> Result<f64, Rejection> {
        let found =
            names.iter().zip(positions).find(|(name, _)| *name == joint).map(|(_, position)| *position);
        match found {
            Some(position) if position.is_finite() => Ok(position),
            Some(value) => Err(Rejection::NonFinite { field: format!("position of {joint:?}"), value }),
            None => {
                let names = names.iter().take(8).cloned().collect();
                Err(Rejection::MissingJoint { joint: joint.to_owned(), names })
            }
        }
    }
}
