//! Poses as messages have them.

use crate::messages::{Point, Pose, Quaternion, Transform, Vector3};
use dq_algebra::UnitDualQuaternion;

/// A pose in numbers: x y z \[m\], then qx qy qz qw.
pub type PoseNumbers = [f64; 7];

/// The numbers of a pose.
pub fn pose_numbers(pose: &UnitDualQuaternion) -> PoseNumbers {
    let (t, r) = (pose.translation(), pose.rotation());
    [t.x, t.y, t.z, r.i, r.j, r.k, r.w]
}

impl From<PoseNumbers> for Pose {
    fn from([x, y, z, qx, qy, qz, qw]: PoseNumbers) -> Self {
        Self { position: Point { x, y, z }, orientation: Quaternion { x: qx, y: qy, z: qz, w: qw } }
    }
}

impl From<&nalgebra::Vector3<f64>> for Point {
    fn from(point: &nalgebra::Vector3<f64>) -> Self {
        Self { x: point.x, y: point.y, z: point.z }
    }
}

impl From<&UnitDualQuaternion> for Pose {
    fn from(pose: &UnitDualQuaternion) -> Self {
        pose_numbers(pose).into()
    }
}

impl From<&UnitDualQuaternion> for Transform {
    fn from(pose: &UnitDualQuaternion) -> Self {
        let Pose { position: Point { x, y, z }, orientation } = pose.into();
        Self { translation: Vector3 { x, y, z }, rotation: orientation }
    }
}
