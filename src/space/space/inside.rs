//! The distance between a point inside a shape and the surface of the shape.

use super::{Gap, Shape};
use nalgebra::Vector3;

impl Shape {
    /// Returns the gap between a point inside the shape and the surface of the shape. If the point is outside, the gap's distance
    /// is negative.
    pub fn gap_inside(&self, point: &Vector3<f64>) -> Gap {
        let (distance, outward) = self.distance(point);
        gap(point, -distance, -outward)
    }

    /// Calls `each` once for each face of a box, a cylinder or a hull, with the gap between `point`, which is inside, and that face.
    /// Other shapes have a single smooth surface, for which [`gap_inside`](Self::gap_inside) is enough.
    pub(super) fn faces(&self, point: &Vector3<f64>, mut each: impl FnMut(Gap)) {
        let mut between = |half: f64, along: f64, direction: Vector3<f64>| {
            each(gap(point, half - along, -direction));
            each(gap(point, half + along, direction));
        };
        match self {
            Self::Box { base_from_box, half } => {
                let local = base_from_box.inverse_transform_point(&(*point).into());
                for axis in 0..3 {
                    between(half[axis], local[axis], base_from_box.rotation * Vector3::ith(axis, 1.0));
                }
            }
            Self::Cylinder { axis, center, radius, half_length } => {
                between(*half_length, axis.direction().dot(&(point - center)), axis.direction());
                let across = axis.offset(point);
                if let Some(outward) = across.try_normalize(0.0) {
                    each(gap(point, radius - across.norm(), -outward));
                }
            }
            Self::Hull(hull) => {
                hull.planes(point).for_each(|(above, outward)| each(gap(point, -above, -outward)));
            }
            Self::HalfSpace(_) | Self::Sphere { .. } | Self::Capsule { .. } => {}
        }
    }
}

/// Returns the gap between `point` and a surface at `distance` from it, in the direction opposite to `normal`.
fn gap(point: &Vector3<f64>, distance: f64, normal: Vector3<f64>) -> Gap {
    Gap { distance, normal, point: *point, other: point - distance * normal }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::space::KeepOut;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn inside_the_nearest_face_is_the_edge(at in prop::array::uniform3(-1.5..1.5f64)) {
            let point = Vector3::from(at);
            for text in ["cell box 0.1 0.2 0.3 1.2 1.3 1.4 0.5 0.5 0.5 0.5", "hall cylinder 0.1 0.2 0.2 0.8 1.6 0.6 0 0 0.8", "tent hull -1 -0.8 0 1 -0.9 0.1 1 1 0 -1 1 0.1 -0.8 0.1 1 0.9 0 1.2"] {
                let shape = text.parse::<KeepOut>().unwrap().shape;
                let edge = shape.gap_inside(&point);
                let mut faces = Vec::new();
                shape.faces(&point, |gap| faces.push(gap));
                let nearest = faces.iter().map(|face| face.distance).fold(f64::INFINITY, f64::min);
                // Outside, near an edge between two faces, both faces are nearer than the edge.
                let is_right = if nearest >= 0.0 { (edge.distance - nearest).abs() < 1e-12 } else { edge.distance <= nearest + 1e-12 };
                prop_assert!(is_right, "{text}: {} {nearest}", edge.distance);
                for gap in faces.iter().chain([&edge]) {
                    prop_assert!((gap.point - gap.other - gap.distance * gap.normal).norm() < 1e-12);
                    let ahead = shape.gap_inside(&(point + 1e-6 * gap.normal)).distance;
                    prop_assert!(nearest < 0.0 || ahead >= edge.distance - 1e-9 || gap.distance > edge.distance);
                }
                let (signed, _) = shape.distance(&edge.other);
                prop_assert!(signed.abs() < 1e-9, "{text}: its point of the edge is {signed} off");
            }
        }
    }
}
