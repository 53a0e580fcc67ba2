//! Poses as arrays of numbers.

use crate::messages::{Point, Pose, Quaternion};

/// The position and the quaternion of a pose: x y z \[m\], then qx qy qz qw.
pub type PoseNumbers = [f64; 7];

impl From<PoseNumbers> for Pose {
    fn from([x, y, z, qx, qy, qz, qw]: PoseNumbers) -> Self {
        Self { position: Point { x, y, z }, orientation: Quaternion { x: qx, y: qy, z: qz, w: qw } }
    }
}
