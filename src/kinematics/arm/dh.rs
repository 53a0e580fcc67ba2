//! Denavit–Hartenberg rows.

use super::{ArmError, bounds};
use dq_algebra::UnitDualQuaternion;
use nalgebra::Vector3;
use std::str::FromStr;

/// The Denavit–Hartenberg convention of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Convention {
    /// Craig's convention: `Rx(α) Tx(a) Tz(d) Rz(θ)`. α and a belong to the link before the joint.
    ModifiedDh,
    /// The original convention: `Rz(θ) Tz(d) Tx(a) Rx(α)`.
    StandardDh,
}

impl FromStr for Convention {
    type Err = ArmError;
    fn from_str(name: &str) -> Result<Self, ArmError> {
        match name {
            "modified_dh" => Ok(Self::ModifiedDh),
            "standard_dh" => Ok(Self::StandardDh),
            other => Err(ArmError::UnknownConvention(other.to_owned())),
        }
    }
}

/// The Denavit–Hartenberg parameters of one joint and its link.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DhRow {
    /// Link twist \[rad\].
    pub alpha: f64,
    /// Link length \[m\].
    pub a: f64,
    /// Link offset \[m\].
    pub d: f64,
    /// The offset added to the joint angle \[rad\].
    pub theta_offset: f64,
}

impl DhRow {
    /// Returns the transform of the row without the joint's rotation, with its factors in the order of the convention.
    pub(super) fn fixed(&self, convention: Convention) -> UnitDualQuaternion {
        let turn =
            UnitDualQuaternion::from_translation_angle_axis(Vector3::zeros(), self.alpha, &Vector3::x_axis());
        let shift = UnitDualQuaternion::from_translation_angle_axis(
            Vector3::new(self.a, 0.0, self.d),
            0.0,
            &Vector3::z_axis(),
        );
        match convention {
            Convention::ModifiedDh => turn * shift,
            Convention::StandardDh => shift * turn,
        }
    }

    /// Checks the numbers of the row of joint `joint` against [`bounds`].
    pub(super) fn check(&self, joint: usize) -> Result<(), ArmError> {
        let named = [
            ("alpha", self.alpha, bounds::LINK_ANGLE, "rad"),
            ("a", self.a, bounds::LENGTH, "m"),
            ("d", self.d, bounds::LENGTH, "m"),
            ("theta_offset", self.theta_offset, bounds::LINK_ANGLE, "rad"),
        ];
        named.into_iter().try_for_each(|(parameter, value, bound, unit)| match value.abs() {
            size if !size.is_finite() => Err(ArmError::NonFinite { parameter, joint, value }),
            size if size > bound => Err(ArmError::OutOfRange { parameter, joint, value, bound, unit }),
            _ => Ok(()),
        })
    }
}
