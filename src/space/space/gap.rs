//! The gap between two objects, with its direction.

use nalgebra::Vector3;

/// The gap between a point of a capsule's core and another object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gap {
    /// Its width \[m\]; negative if the two overlap.
    pub distance: f64,
    /// The direction, of unit length, in which it grows fastest when the point of the capsule moves.
    pub normal: Vector3<f64>,
    /// The point of the capsule's core \[m\].
    pub point: Vector3<f64>,
    /// The other end \[m\]: a point of the core of the other capsule, or for a keep-out the point at which the normal begins.
    pub other: Vector3<f64>,
}

impl Gap {
    /// Returns the gap reduced by `radius`, the thickness around the cores.
    pub fn less(self, radius: f64) -> Self {
        Self { distance: self.distance - radius, ..self }
    }
}
