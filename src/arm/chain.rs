//! A serial chain of revolute joints and its forward kinematics.

use super::{ArmError, ArmState, Convention, DhRow};
use crate::dq::UnitDualQuaternion;
use nalgebra::Vector3;

/// A serial arm with any number of revolute joints.
///
/// Both DH conventions become one form: before each rotation about z there is a fixed transform, and after the last a
/// fixed transform to the tool.
#[derive(Clone, Debug, PartialEq)]
pub struct Chain {
    /// Link i−1 (or the base) from the frame in which joint i turns about z, at θ = 0.
    before_joint: Vec<UnitDualQuaternion>,
    last_link_from_tool: UnitDualQuaternion,
    /// Where the arm stands.
    base_point: Vector3<f64>,
    reach: f64,
}

impl Chain {
    /// From DH rows, base first.
    ///
    /// # Errors
    /// [`ArmError::NoJoints`], [`ArmError::NonFinite`], [`ArmError::OutOfRange`].
    pub fn new(convention: Convention, rows: &[DhRow]) -> Result<Self, ArmError> {
        if rows.is_empty() {
            return Err(ArmError::NoJoints);
        }
        rows.iter().enumerate().try_for_each(|(i, row)| row.check(i + 1))?;
        let fixed = rows.iter().map(|row| row.fixed(convention));
        let (mut before, last_link_from_tool): (Vec<_>, _) = match convention {
            Convention::ModifiedDh => (fixed.collect(), UnitDualQuaternion::identity()),
            Convention::StandardDh => {
                let mut shifted: Vec<_> =
                    std::iter::once(UnitDualQuaternion::identity()).chain(fixed).collect();
                let last = shifted.pop().unwrap_or_else(UnitDualQuaternion::identity);
                (shifted, last)
            }
        };
        for (transform, row) in before.iter_mut().zip(rows) {
            *transform = transform.rotated_about_z(row.theta_offset);
        }
        let reach = rows.iter().map(DhRow::length).sum();
        Ok(Self { before_joint: before, last_link_from_tool, base_point: Vector3::zeros(), reach })
    }

    /// The number of joints.
    pub fn joint_count(&self) -> usize {
        self.before_joint.len()
    }

    /// The same arm standing at `world_from_base`: from then on its base frame is the world.
    pub fn standing_at(mut self, world_from_base: &UnitDualQuaternion) -> Self {
        if let Some(first) = self.before_joint.first_mut() {
            *first = *world_from_base * *first;
        }
        self.base_point = world_from_base.rotation() * self.base_point + world_from_base.translation();
        self
    }

    /// Where the arm stands \[m\].
    pub fn base_point(&self) -> Vector3<f64> {
        self.base_point
    }

    /// An upper bound of the distance from where the arm stands to its tool \[m\].
    pub fn reach(&self) -> f64 {
        self.reach
    }

    /// `base_from_tool` at joint angles `theta` \[rad\] (eq. 14), with the sign that the product of the factors has.
    ///
    /// # Errors
    /// [`ArmError::JointCount`].
    pub fn forward_kinematics(&self, theta: &[f64]) -> Result<UnitDualQuaternion, ArmError> {
        let last = self.link_poses(theta)?.last().copied().unwrap_or_else(UnitDualQuaternion::identity);
        Ok(last * self.last_link_from_tool)
    }

    /// `base_from_link` of each link: the frame that turns with joint i, z along its axis.
    ///
    /// # Errors
    /// [`ArmError::JointCount`].
    pub fn link_poses(&self, theta: &[f64]) -> Result<Vec<UnitDualQuaternion>, ArmError> {
        self.check_count(theta)?;
        let mut base_from_link = UnitDualQuaternion::identity();
        let poses = self.before_joint.iter().zip(theta).map(|(before, angle)| {
            base_from_link = (base_from_link * *before).rotated_about_z(*angle);
            base_from_link
        });
        Ok(poses.collect())
    }

    /// Fills `state` with the tool pose and the joint axes at `theta` \[rad\], without allocating.
    ///
    /// # Errors
    /// [`ArmError::JointCount`] where `theta` or `state` do not fit this arm.
    pub fn evaluate(&self, theta: &[f64], state: &mut ArmState) -> Result<(), ArmError> {
        self.check_count(theta)?;
        let mut base_from_link = UnitDualQuaternion::identity();
        let axes = state.axes_mut(self.joint_count())?;
        for ((before, angle), axis) in self.before_joint.iter().zip(theta).zip(axes) {
            let base_from_joint = base_from_link * *before;
            axis.direction = base_from_joint.rotation() * Vector3::z();
            axis.point = base_from_joint.translation();
            base_from_link = base_from_joint.rotated_about_z(*angle);
        }
        state.set_tool(base_from_link * self.last_link_from_tool);
        Ok(())
    }

    /// The tool in the last link.
    pub fn last_link_from_tool(&self) -> UnitDualQuaternion {
        self.last_link_from_tool
    }

    /// Each joint's frame at θ = 0 in the link before it (or the base), base first.
    pub(super) fn parent_from_joint(&self) -> &[UnitDualQuaternion] {
        &self.before_joint
    }

    fn check_count(&self, theta: &[f64]) -> Result<(), ArmError> {
        match theta.len() == self.joint_count() {
            true => Ok(()),
            false => Err(ArmError::JointCount { expected: self.joint_count(), got: theta.len() }),
        }
    }
}
