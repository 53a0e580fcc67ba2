//! The gap between two objects, with its direction.

use nalgebra::Vector3;

/// The gap between a capsule's segment and another object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gap {
    /// The width of the gap \[m\]; negative if the two objects overlap.
    pub distance: f64,
    /// The direction, of unit length, in which the gap grows fastest if the point of the capsule moves.
    pub normal: Vector3<f64>,
    /// The end of the gap on the capsule's segment \[m\].
    pub point: Vector3<f64>,
    /// The other end of the gap \[m\]. Between two capsules, this is a point of the other segment. At a keep-out, it is a point of
    /// the keep-out's surface.
    pub other: Vector3<f64>,
}

impl Gap {
    /// Returns the gap reduced by `radius`, the sum of the radii of both parts around their segments \[m\].
    pub fn less(self, radius: f64) -> Self {
        Self { distance: self.distance - radius, ..self }
    }
}
