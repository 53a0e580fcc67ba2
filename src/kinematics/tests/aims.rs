//! Aims with fewer components than a pose, for the tests of the laws and of the cycle.

use dq_algebra::UnitDualQuaternion;
use dq_kinematics::control::Aim;
use nalgebra::{UnitQuaternion, Vector3};

pub const LESS: [Aim; 2] = [Aim::Position, Aim::PositionAndAxis];

pub fn turned(pose: &UnitDualQuaternion, by: Vector3<f64>) -> UnitDualQuaternion {
    UnitDualQuaternion::from_parts(pose.rotation() * UnitQuaternion::new(by), pose.translation())
}

pub fn z(pose: &UnitDualQuaternion) -> Vector3<f64> {
    pose.rotation() * Vector3::z()
}

/// Returns the error of the tool in the components of the aim \[m, rad\].
pub fn missed(aim: Aim, tool: &UnitDualQuaternion, goal: &UnitDualQuaternion) -> (f64, f64) {
    let angle = match aim {
        Aim::Pose => tool.rotation().angle_to(&goal.rotation()),
        Aim::Position => 0.0,
        Aim::Orientation | Aim::Distance => unreachable!("not of one arm"),
        Aim::PositionAndAxis => z(tool).cross(&z(goal)).norm().atan2(z(tool).dot(&z(goal))),
    };
    ((tool.translation() - goal.translation()).norm(), angle)
}
