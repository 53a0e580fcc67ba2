//! Joints: their kinds, their axes, and their frames in a chain.

use dq_algebra::UnitDualQuaternion;
use nalgebra::{Unit, Vector3};
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// The kind of a joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum JointKind {
    /// The joint turns about its axis: its position is an angle \[rad\].
    Revolute,
    /// The joint slides along its axis: its position is a length \[m\].
    Prismatic,
}

impl JointKind {
    /// Returns the unit of the joint's position.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Revolute => "rad",
            Self::Prismatic => "m",
        }
    }

    /// Returns the displacement between two positions. For a revolute joint, it is the shorter of the two rotations \[rad\],
    /// because encoders wrap; for a prismatic joint, the difference \[m\].
    pub fn displacement(self, from: f64, to: f64) -> f64 {
        let whole = to - from;
        match self {
            Self::Revolute => whole - TAU * (whole / TAU).round(),
            Self::Prismatic => whole,
        }
    }
}

/// A joint of a chain, as a robot description such as URDF defines it.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// The kind of the joint.
    pub kind: JointKind,
    /// The joint's frame at position 0, relative to the frame of the previous joint or the base.
    pub parent_from_joint: UnitDualQuaternion,
    /// The joint's axis, in its own frame.
    pub axis: Unit<Vector3<f64>>,
}
