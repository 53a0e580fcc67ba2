//! A joint: what it does, and where.

use dq_algebra::UnitDualQuaternion;
use nalgebra::{Unit, Vector3};

/// What a joint does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JointKind {
    /// It turns about its axis: its position is an angle \[rad\].
    Revolute,
    /// It slides along its axis: its position is a length \[m\].
    Prismatic,
}

impl JointKind {
    /// The unit of its position.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Revolute => "rad",
            Self::Prismatic => "m",
        }
    }
}

/// A joint of a chain, as a robot description gives it.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// What it does.
    pub kind: JointKind,
    /// Its frame at position 0 in that of the joint before it, or in the base frame.
    pub parent_from_joint: UnitDualQuaternion,
    /// Its axis, in its own frame.
    pub axis: Unit<Vector3<f64>>,
}
