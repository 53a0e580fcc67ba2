//! The directions in which an arm can move its tool. The servo reports them for a twist that the arm cannot follow.

use super::Twist;
use dq_kinematics::arm::ArmState;
use dq_kinematics::control::Aim;
use nalgebra::{Matrix6, UnitQuaternion, Vector3, Vector6};

/// An arm counts as able to follow a twist if at least this fraction of the twist's squared size lies in the space of the arm's
/// possible motions.
const FOLLOWED: f64 = 0.5;

/// An arm counts as able to move along an axis if at most this fraction of the axis's squared length lies outside the space of the
/// arm's possible motions.
const MISSING: f64 = 1e-3;

/// An arm counts as unable to move its tool along a left singular vector of the Jacobian if the singular value is below this [m/rad,
/// prismatic: 1].
const SMALLEST: f64 = 0.02;

/// The axes along which an arm can move its tool, and the axes about which it can turn the tool. An axis counts only if the arm can
/// make this motion without any other motion of the tool.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FreeDirections {
    /// Whether the arm can turn the tool about x, y and z, then whether it can move the tool along x, y and z.
    each: [bool; 6],
    /// Whether the axes are the tool's. Otherwise they are the base's.
    in_tool: bool,
}

impl FreeDirections {
    /// Returns the directions in which `arm` can move, if it cannot follow `twist`. The arm has to follow only the components that
    /// `aim` constrains. `axes` is the rotation of the tool relative to the base.
    ///
    /// Returns `None` if the arm can follow the twist, or if `aim` constrains components that are not along fixed axes.
    pub(super) fn instead_of(
        twist: &Twist,
        aim: Aim,
        arm: &ArmState,
        axes: &UnitQuaternion<f64>,
    ) -> Option<Self> {
        let (turns, moves) = match aim {
            Aim::Pose => (1.0, 1.0),
            Aim::Position => (0.0, 1.0),
            Aim::Orientation => (1.0, 0.0),
            // The components of these aims are not along fixed axes.
            Aim::PositionAndAxis | Aim::Distance => return None,
        };
        let turned = |v: Vector3<f64>| if twist.in_tool { axes.inverse() * v } else { v };
        let six = |angular: Vector3<f64>, linear: Vector3<f64>| {
            let [angular, linear] = [turns * angular, moves * linear];
            Vector6::new(angular.x, angular.y, angular.z, linear.x, linear.y, linear.z)
        };
        let wanted = six(twist.angular, twist.linear).try_normalize(f64::MIN_POSITIVE)?;
        let columns = arm.tool_motions().map(|(angular, linear)| six(turned(angular), turned(linear)));
        let eigen =
            columns.fold(Matrix6::zeros(), |sum, column| sum + column * column.transpose()).symmetric_eigen();
        let possible = eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter());
        let possible = possible.filter(|(square, _)| **square > SMALLEST * SMALLEST);
        let projector = possible.fold(Matrix6::zeros(), |sum, (_, way)| sum + way * way.transpose());
        if wanted.dot(&(projector * wanted)) >= FOLLOWED {
            return None;
        }
        let each = std::array::from_fn(|axis| projector[(axis, axis)] > 1.0 - MISSING);
        Some(Self { each, in_tool: twist.in_tool })
    }

    /// Explains that the arm cannot follow, and in which directions it can move.
    pub fn explain(&self) -> String {
        let [about, along] = [&self.each[..3], &self.each[3..]].map(|three| {
            let names = ["x", "y", "z"].into_iter().zip(three).filter(|(_, is_free)| **is_free);
            names.map(|(name, _)| name).collect::<Vec<_>>().join(", ")
        });
        let whose = if self.in_tool { "the tool" } else { "the base" };
        let can = match (along.is_empty(), about.is_empty()) {
            (false, false) => format!("move along {along} and turn about {about} of {whose}"),
            (false, true) => format!("move along {along} of {whose}"),
            (true, false) => format!("turn about {about} of {whose}"),
            (true, true) => "move only along several axes at once".to_owned(),
        };
        format!("the arm has no joints for this twist here: it can {can}")
    }
}
