//! A joint: what it does, and where.

use dq_algebra::UnitDualQuaternion;
use nalgebra::{Unit, Vector3};
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// What a joint does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
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

    /// The displacement from one position to another: of a joint that turns the shorter one \[rad\], as encoders wrap; of one that slides the
    /// whole one \[m\].
    pub fn displacement(self, from: f64, to: f64) -> f64 {
        let whole = to - from;
        match self {
            Self::Revolute => whole - TAU * (whole / TAU).round(),
            Self::Prismatic => whole,
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
