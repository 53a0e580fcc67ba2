//! Convex solid shapes, and the signed distances of points and segments from them.

use super::{Gap, Hull, Segment};
use dq_algebra::{Line, Plane};
use nalgebra::{Isometry3, Vector2, Vector3};

/// A convex solid shape, in the base frame.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// All points behind a plane.
    HalfSpace(Plane),
    /// A ball.
    Sphere {
        /// The center of the ball \[m\].
        center: Vector3<f64>,
        /// The radius of the ball \[m\].
        radius: f64,
    },
    /// All points within a radius of a segment.
    Capsule {
        /// The segment.
        core: Segment,
        /// The radius \[m\].
        radius: f64,
    },
    /// A box.
    Box {
        /// The center of the box, and the directions of its edges.
        base_from_box: Isometry3<f64>,
        /// Half the length of each edge \[m\].
        half: Vector3<f64>,
    },
    /// A cylinder.
    Cylinder {
        /// The axis of the cylinder.
        axis: Line,
        /// The center of the cylinder \[m\].
        center: Vector3<f64>,
        /// The radius of the cylinder \[m\].
        radius: f64,
        /// Half the length of the cylinder \[m\].
        half_length: f64,
    },
    /// The convex hull of points.
    Hull(Hull),
}

/// The accuracy of a segment's distance from a shape \[m\].
const EXACT: f64 = 1e-12;
/// The largest number of steps of the search for a segment's distance.
const STEPS: u32 = 40;

impl Shape {
    /// Returns the signed distance of `point` from the shape \[m\], negative inside, and the gradient of that distance, a unit
    /// vector. The distance is a convex function of the point, because the shape is convex. If the point moves, the distance
    /// changes by at most the length of the motion.
    pub fn distance(&self, point: &Vector3<f64>) -> (f64, Vector3<f64>) {
        match self {
            Self::HalfSpace(plane) => (plane.distance(point), plane.normal()),
            Self::Sphere { center, radius } => {
                let (distance, normal) = length(&(point - center));
                (distance - radius, normal)
            }
            Self::Capsule { core, radius } => {
                let gap = core.gap_of(point);
                (gap.distance - radius, gap.normal)
            }
            Self::Box { base_from_box, half } => {
                let local = base_from_box.inverse_transform_point(&(*point).into()).coords;
                let beyond = local.abs() - half;
                let (distance, gradient) = outside(&beyond);
                let signed = gradient.zip_map(&local, |part, place| part * 1.0_f64.copysign(place));
                (distance, base_from_box.rotation * signed)
            }
            Self::Cylinder { axis, center, radius, half_length } => {
                let (across, outward) = length(&axis.offset(point));
                let along = axis.direction().dot(&(point - center));
                let beyond = Vector2::new(across - radius, along.abs() - half_length);
                let (distance, gradient) = outside(&beyond);
                let axial = axis.direction() * 1.0_f64.copysign(along);
                (distance, gradient.x * outward + gradient.y * axial)
            }
            Self::Hull(hull) => hull.distance(point),
        }
    }

    /// Returns a lower bound of the signed distance of `point` from the shape \[m\]. This takes little computation for every shape.
    pub(super) fn at_least(&self, point: &Vector3<f64>) -> f64 {
        match self {
            Self::Hull(hull) => hull.at_least(point),
            _ => self.distance(point).0,
        }
    }

    /// Returns the gap between the shape and the nearest point of `segment`. If the segment enters the shape, its deepest point
    /// counts.
    pub fn gap_to(&self, segment: &Segment) -> Gap {
        match self {
            Self::Sphere { center, radius } => {
                let point = segment.gap_of(center);
                let gap = Segment { ends: [*center; 2] }.gap_of(&point.other);
                gap.less(*radius)
            }
            Self::Capsule { core, radius } => segment.gap_to(core).less(*radius),
            Self::HalfSpace(_) | Self::Box { .. } | Self::Cylinder { .. } | Self::Hull(_) => {
                self.lowest(segment)
            }
        }
    }

    /// Returns the gap between the shape and `point`.
    pub fn gap_at(&self, point: &Vector3<f64>) -> Gap {
        let (distance, normal) = self.distance(point);
        Gap { distance, normal, point: *point, other: point - distance * normal }
    }

    /// Returns the gap at the point of the segment that has the smallest distance. The distance is convex, so the tangents at two
    /// points intersect at a lower bound of the distance. The next point to evaluate is at this intersection (Kelley 1960).
    fn lowest(&self, segment: &Segment) -> Gap {
        let along = segment.vector();
        let at = |part: f64| {
            let gap = self.gap_at(&segment.at(part));
            (part, gap, gap.normal.dot(&along))
        };
        let (mut falling, mut rising) = (at(0.0), at(1.0));
        if falling.2 >= 0.0 {
            return falling.1;
        }
        if rising.2 <= 0.0 {
            return rising.1;
        }
        let mut best = if falling.1.distance < rising.1.distance { falling.1 } else { rising.1 };
        for _ in 0..STEPS {
            let (left, right) = (falling.1.distance, rising.1.distance);
            let meet = (right - left + falling.2 * falling.0 - rising.2 * rising.0) / (falling.2 - rising.2);
            let bound = left + falling.2 * (meet - falling.0);
            if best.distance - bound <= EXACT {
                break;
            }
            let next = at(meet);
            if next.1.distance < best.distance {
                best = next.1;
            }
            *(if next.2 < 0.0 { &mut falling } else { &mut rising }) = next;
        }
        best
    }
}

/// Returns the length of a vector, and its direction. The direction of a zero vector is arbitrary.
fn length(vector: &Vector3<f64>) -> (f64, Vector3<f64>) {
    let length = vector.norm();
    if length > 0.0 { (length, vector / length) } else { (0.0, Vector3::x()) }
}

/// Returns the signed distance of the point `beyond` from the set of all points whose components are 0 or negative, and the
/// gradient of that distance.
fn outside<const N: usize>(beyond: &nalgebra::SVector<f64, N>) -> (f64, nalgebra::SVector<f64, N>) {
    let out = beyond.map(|part| part.max(0.0));
    let distance = out.norm();
    if distance > 0.0 {
        return (distance, out / distance);
    }
    let largest = beyond.imax();
    let mut gradient = nalgebra::SVector::zeros();
    gradient[largest] = 1.0;
    (beyond[largest], gradient)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Translation3, Unit, UnitQuaternion};
    use proptest::prelude::*;

    fn vector() -> impl Strategy<Value = Vector3<f64>> {
        prop::array::uniform3(-1.0..1.0f64).prop_map(Vector3::from)
    }

    fn shape() -> impl Strategy<Value = Shape> {
        let sizes = prop::array::uniform3(0.05..0.6f64);
        let points = prop::collection::vec(vector(), 4..30);
        (0..6usize, vector(), vector(), (vector(), points), sizes).prop_filter_map(
            "flat",
            |(kind, at, along, (turn, points), [a, b, c])| {
                let direction = Unit::new_normalize(along + Vector3::new(0.0, 0.0, 1.1));
                Some(match kind {
                    0 => Shape::HalfSpace(Plane::new(&direction, &at)),
                    1 => Shape::Sphere { center: at, radius: a },
                    2 => Shape::Capsule { core: Segment { ends: [at, at + along] }, radius: a },
                    3 => Shape::Box {
                        base_from_box: Isometry3::from_parts(
                            Translation3::from(at),
                            UnitQuaternion::new(turn),
                        ),
                        half: Vector3::new(a, b, c),
                    },
                    4 => Shape::Cylinder {
                        axis: Line::new(&direction, &at),
                        center: at,
                        radius: a,
                        half_length: b,
                    },
                    _ => Shape::Hull(Hull::of(&points)?),
                })
            },
        )
    }

    proptest! {
        #[test]
        fn the_gradient_is_the_slope_of_the_distance(shape in shape(), point in vector(), along in vector()) {
            let (_, gradient) = shape.distance(&point);
            prop_assert!((gradient.norm() - 1.0).abs() < 1e-9);
            let step = 1e-6;
            let at = |side: f64| shape.distance(&(point + side * step * along));
            let slope = (at(1.0).0 - at(-1.0).0) / (2.0 * step);
            // Inside a box or a hull, near an edge, the gradient changes its direction within the step.
            prop_assume!((at(1.0).1 - at(-1.0).1).norm() < 1e-3);
            prop_assert!((slope - gradient.dot(&along)).abs() < 1e-5, "{slope} {}", gradient.dot(&along));
        }

        #[test]
        fn no_point_is_nearer_than_the_lower_bound(shape in shape(), point in vector()) {
            prop_assert!(shape.at_least(&point) <= shape.distance(&point).0 + 1e-9);
        }

        #[test]
        fn no_point_of_a_segment_is_nearer_than_the_gap(shape in shape(), one in vector(), other in vector()) {
            let segment = Segment { ends: [one, other] };
            let gap = shape.gap_to(&segment);
            for i in 0..=200 {
                let (distance, _) = shape.distance(&segment.at(f64::from(i) / 200.0));
                prop_assert!(distance >= gap.distance - 1e-7, "{distance} {}", gap.distance);
            }
            let (at_it, _) = shape.distance(&gap.point);
            prop_assert!((at_it - gap.distance).abs() < 1e-7, "{at_it} {}", gap.distance);
        }
    }
}
