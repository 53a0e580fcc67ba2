//! The gap between two objects: the signed distance between them, and its direction.

use nalgebra::Vector3;

/// The gap between a capsule's segment, or one point of the segment, and another object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gap {
    /// The signed distance \[m\], negative if the two objects overlap.
    pub distance: f64,
    /// The direction, of unit length, in which the gap grows fastest if the point of the capsule moves.
    pub normal: Vector3<f64>,
    /// The point on the capsule's segment from which the gap is measured \[m\].
    pub point: Vector3<f64>,
    /// The point of the other object to which the gap is measured \[m\]. If the object is a capsule, this is a point of its
    /// segment. If the object is a keep-out or a keep-in, this is a point of its surface.
    pub other: Vector3<f64>,
}

impl Gap {
    /// Returns the gap between two parts from the gap between their segments. `radius` is the sum of the radii of both parts \[m\].
    pub fn less(self, radius: f64) -> Self {
        Self { distance: self.distance - radius, ..self }
    }
}
