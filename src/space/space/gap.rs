//! How far two things are from each other, and along which line.

use nalgebra::Vector3;

/// The gap between a point of a capsule's core and what is beside it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gap {
    /// Its width \[m\]; negative where the two are in each other.
    pub distance: f64,
    /// The direction in which it grows fastest with the point of the capsule, of unit length.
    pub normal: Vector3<f64>,
    /// The point of the capsule's core \[m\].
    pub point: Vector3<f64>,
    /// The point beside it \[m\], on the core of the other capsule; of a keep-out it is where the normal begins.
    pub other: Vector3<f64>,
}

impl Gap {
    /// The same with what is around the cores taken away.
    pub fn less(self, radius: f64) -> Self {
        Self { distance: self.distance - radius, ..self }
    }
}
