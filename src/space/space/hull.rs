//! Convex hulls of points: their faces, and the distance of a point from a hull. Only this module uses parry3d and its vectors.

use nalgebra::{Matrix3, Vector3};
use parry3d_f64::math::Vector;
use parry3d_f64::query::PointQuery;
use parry3d_f64::shape::Triangle;
use parry3d_f64::transformation::try_convex_hull;
use std::sync::Arc;

/// The convex hull of points. Its copies share the faces.
#[derive(Clone, Debug)]
pub struct Hull {
    faces: Arc<[Face]>,
    /// A ball around the hull.
    ball: Ball,
    /// The largest distance from a face's plane at which a point counts as a point of the plane \[m\].
    near: f64,
}

/// A bounding ball. It makes most distance computations unnecessary.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Ball {
    /// The center \[m\].
    center: Vector3<f64>,
    /// The radius \[m\].
    radius: f64,
}

impl PartialEq for Hull {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.faces, &other.faces) || self.faces == other.faces
    }
}

/// A flat part of the surface.
#[derive(Clone, Debug, PartialEq)]
struct Face {
    /// The outward normal, of unit length.
    normal: Vector3<f64>,
    /// One of the corners of the face \[m\].
    corner: Vector3<f64>,
    /// A ball around the face.
    ball: Ball,
    /// The triangles of the face, at least one. Each is given by its corners \[m\], counterclockwise as seen from outside.
    triangles: Vec<[Vector3<f64>; 3]>,
}

/// A hull counts as flat if its thickness is at most this many meters, or at most this fraction of its length.
pub(super) const FLAT: f64 = 1e-6;

/// The largest distance from a plane at which a point counts as a point of the plane, as a fraction of the hull's length.
const EXACT: f64 = 1e-8;

/// A point counts as directly above a face if its nearest point on the face and its projection onto the face's plane are at most
/// this far apart \[m\].
const TOGETHER: f64 = 1e-12;

impl Hull {
    /// Computes the hull of `points` \[m\]. Returns `None` if the points lie in a plane, or so near to a plane that the faces are
    /// not found.
    pub fn of(points: &[Vector3<f64>]) -> Option<Self> {
        let (length, evenly) = spread(points)?;
        let near = EXACT * length;
        let points = apart(points, near);
        // Scaling does not change which points are corners. Without scaling, parry3d treats a hull as flat if its thickness is a
        // thousandth of its length.
        let even: Vec<_> = points.iter().map(|point| foreign(&(evenly * (point - points[0])))).collect();
        let (corners, numbers) = try_convex_hull(&even).ok()?;
        let known = |corner: &Vector| even.iter().position(|one| one == corner).map(|number| points[number]);
        let corners: Vec<_> = corners.iter().map(known).collect::<Option<_>>()?;
        let mut triangles: Vec<_> =
            numbers.iter().map(|of| of.map(|number| corners[number as usize])).collect();
        // The area vectors of a closed surface add up to zero.
        let is_closed = triangles.iter().map(across).sum::<Vector3<f64>>().norm() <= near * length;
        triangles.retain(|it| height(it) > near);
        // The planes of the largest triangles are the most accurate.
        triangles.sort_by(|one, other| across(other).norm().total_cmp(&across(one).norm()));
        let mut faces: Vec<Face> = Vec::new();
        for triangle in triangles {
            let is_of = |face: &&mut Face| triangle.iter().all(|corner| face.above(corner).abs() <= near);
            match faces.iter_mut().find(is_of) {
                Some(face) => face.triangles.push(triangle),
                None => faces.push(Face::of(triangle)),
            }
        }
        faces.iter_mut().for_each(|face| face.ball = Ball::around(face.triangles.as_flattened()));
        let is_behind = |face: &Face| points.iter().all(|point| face.above(point) <= near);
        (is_closed && faces.len() >= 4 && faces.iter().all(is_behind)).then(|| Self {
            ball: Ball::around(&corners),
            faces: faces.into(),
            near,
        })
    }

    /// Yields the triangles of the surface. Each is given by its corners \[m\], counterclockwise as seen from outside.
    pub fn triangles(&self) -> impl Iterator<Item = &[Vector3<f64>; 3]> {
        self.faces.iter().flat_map(|face| &face.triangles)
    }

    /// Yields the two ends of each edge between two faces \[m\].
    pub fn edges(&self) -> impl Iterator<Item = [Vector3<f64>; 2]> {
        self.faces.iter().flat_map(|face| {
            let sides = || face.triangles.iter().flat_map(|[a, b, c]| [[*a, *b], [*b, *c], [*c, *a]]);
            // Each edge occurs twice, in opposite directions. An edge inside a face occurs both times in that face.
            sides().filter(move |[from, to]| {
                from.iter().lt(to.iter()) && !sides().any(|side| side == [*to, *from])
            })
        })
    }

    /// Yields, for each face, the height of `point` above the plane of the face \[m\], and the outward normal.
    pub(super) fn planes(&self, point: &Vector3<f64>) -> impl Iterator<Item = (f64, Vector3<f64>)> {
        self.faces.iter().map(|face| (face.above(point), face.normal))
    }

    /// Returns a lower bound of the signed distance of `point` from the hull \[m\]. This takes little computation.
    pub(super) fn at_least(&self, point: &Vector3<f64>) -> f64 {
        self.ball.at_least(point)
    }

    /// Returns the signed distance of `point` from the hull \[m\], negative inside, and the gradient of that distance.
    pub(super) fn distance(&self, point: &Vector3<f64>) -> (f64, Vector3<f64>) {
        let (mut highest, mut first) = (f64::NEG_INFINITY, &self.faces[0]);
        for face in &*self.faces {
            let above = face.above(point);
            if above > highest {
                (highest, first) = (above, face);
            }
        }
        if highest <= self.near {
            return (highest, first.normal);
        }
        let mut nearest = first.distance(point, highest);
        for face in &*self.faces {
            let above = face.above(point);
            // No point of a face is nearer than the plane of the face, or than its bounding ball.
            if above > 0.0 && above < nearest.0 && face.ball.at_least(point) < nearest.0 {
                let next = face.distance(point, above);
                if next.0 < nearest.0 {
                    nearest = next;
                }
            }
        }
        nearest
    }
}

impl Face {
    fn of(triangle: [Vector3<f64>; 3]) -> Self {
        let normal = across(&triangle).normalize();
        Self { normal, corner: triangle[0], ball: Ball::around(&triangle), triangles: vec![triangle] }
    }

    fn above(&self, point: &Vector3<f64>) -> f64 {
        self.normal.dot(&(point - self.corner))
    }

    /// Returns the distance of `point` from the face \[m\], and the gradient of that distance. `above` is the height of the point
    /// above the plane.
    fn distance(&self, point: &Vector3<f64>, above: f64) -> (f64, Vector3<f64>) {
        let mut nearest = (f64::INFINITY, self.normal);
        for [a, b, c] in &self.triangles {
            let triangle = Triangle::new(foreign(a), foreign(b), foreign(c));
            let offset = point - own(triangle.project_local_point(foreign(point), true).point);
            let distance = offset.norm();
            if (offset - above * self.normal).norm() <= TOGETHER {
                return (above, self.normal);
            }
            if distance < nearest.0 {
                nearest = (distance, offset / distance);
            }
        }
        nearest
    }
}

/// Returns an estimate of the point cloud's length \[m\], and the matrix that scales the cloud to equal extents. The estimate is at
/// least half of the true length. Returns `None` if the points lie in a plane or too near to a plane (see [`FLAT`]).
fn spread(points: &[Vector3<f64>]) -> Option<(f64, Matrix3<f64>)> {
    let first = points.first()?;
    let farthest = |far: &dyn Fn(&Vector3<f64>) -> f64| {
        let offsets = points.iter().map(|point| point - first);
        offsets.max_by(|one, other| far(one).total_cmp(&far(other)))
    };
    let along = farthest(&|offset| offset.norm())?;
    let normal = along.cross(&farthest(&|offset| along.cross(offset).norm())?).try_normalize(0.0)?;
    let aside = normal.cross(&along).normalize();
    let [wide, thick] = [aside, normal]
        .map(|axis| farthest(&|offset| axis.dot(offset).abs()).map(|offset| axis.dot(&offset).abs()));
    let (length, wide, thick) = (along.norm(), wide?, thick?);
    let evenly = Matrix3::from_columns(&[along / length.powi(2), aside / wide, normal / thick]).transpose();
    (thick > FLAT * length.max(1.0)).then_some((length, evenly))
}

/// Removes each point that is within `near` \[m\] of another point. Otherwise parry3d would lose faces between such corners.
fn apart(points: &[Vector3<f64>], near: f64) -> Vec<Vector3<f64>> {
    // Two corners of a machine part rarely lie in one plane perpendicular to this direction. So each point is compared with few
    // other points.
    let along = |point: &Vector3<f64>| Vector3::new(0.36, 0.48, 0.8).dot(point);
    let mut points = points.to_vec();
    points.sort_by(|one, other| along(one).total_cmp(&along(other)));
    let mut apart: Vec<Vector3<f64>> = Vec::new();
    for point in points {
        let mut close = apart.iter().rev().take_while(|other| along(&(point - *other)) <= near);
        if !close.any(|other| (point - other).norm() <= near) {
            apart.push(point);
        }
    }
    apart
}

impl Ball {
    /// Creates a ball around `points`. Its center is the middle of their bounding box.
    fn around(points: &[Vector3<f64>]) -> Self {
        let bound = |of: fn(&Vector3<f64>, &Vector3<f64>) -> Vector3<f64>| {
            points.iter().copied().reduce(|a, b| of(&a, &b)).unwrap_or_default()
        };
        let center = 0.5 * (bound(Vector3::inf) + bound(Vector3::sup));
        Self { center, radius: points.iter().map(|point| (point - center).norm()).fold(0.0, f64::max) }
    }

    /// Returns a lower bound of the distance of a point from anything inside the ball \[m\].
    fn at_least(&self, point: &Vector3<f64>) -> f64 {
        (point - self.center).norm() - self.radius
    }
}

/// Returns a vector along the normal of a triangle. Its length is twice the triangle's area \[m²\].
fn across([a, b, c]: &[Vector3<f64>; 3]) -> Vector3<f64> {
    (b - a).cross(&(c - a))
}

/// Returns the smallest height of a triangle \[m\].
fn height(triangle: &[Vector3<f64>; 3]) -> f64 {
    let [a, b, c] = triangle;
    across(triangle).norm() / (b - a).norm().max((c - b).norm()).max((a - c).norm())
}

fn foreign(point: &Vector3<f64>) -> Vector {
    Vector::new(point.x, point.y, point.z)
}

fn own(point: Vector) -> Vector3<f64> {
    Vector3::new(point.x, point.y, point.z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::space::Shape;
    use nalgebra::UnitQuaternion;
    use proptest::prelude::*;

    /// Returns random point clouds: points nearly on a grid (many of them coplanar or equal), near corners, on a thin plate, nearly
    /// in two planes, and in one plane. The clouds are rotated, moved and scaled.
    fn cloud() -> impl Strategy<Value = Vec<Vector3<f64>>> {
        let vector = || prop::array::uniform3(-1.0..1.0f64).prop_map(Vector3::from);
        let points = prop::collection::vec(vector(), 4..100);
        let powers = (-3.0..2.0f64, -14.0..-2.0f64)
            .prop_map(|(size, nearly)| (10.0_f64.powf(size), 10.0_f64.powf(nearly)));
        (0..8usize, points, vector(), vector(), powers).prop_map(
            |(kind, points, at, turn, (size, nearly))| {
                let turn = UnitQuaternion::new(3.0 * turn);
                let placed = |point: Vector3<f64>| {
                    let point = match kind {
                        0 => point,
                        1 => point.normalize(),
                        2 => point.map(|x| (2.0 * x).round()) + nearly * point.yzx(),
                        3 => point.map(f64::signum) + nearly * point.yzx(),
                        4 => Vector3::new(point.x, point.y, 1e-4 * point.z),
                        5 => Vector3::new(point.x, point.y, 1e-9 * point.z),
                        6 => Vector3::new(point.x, point.y, 0.1 * point.z.signum()) + nearly * point.yzx(),
                        _ => point.x * Vector3::x(),
                    };
                    size * (turn * point + at)
                };
                points.into_iter().map(placed).collect()
            },
        )
    }

    proptest! {
        #[test]
        fn the_distance_of_a_hull_agrees_with_separating_planes(
            points in cloud(), directions in prop::collection::vec(prop::array::uniform3(-1.0..1.0f64).prop_map(Vector3::from), 1..20)
        ) {
            // Points in a plane have no hull.
            let Some(hull) = Hull::of(&points) else { return Ok(()) };
            let (length, _) = spread(&points).unwrap();
            let middle = points.iter().sum::<Vector3<f64>>() / points.len() as f64;
            let reach = |direction: &Vector3<f64>, from: &Vector3<f64>| {
                points.iter().map(|point| direction.dot(&(point - from))).fold(f64::NEG_INFINITY, f64::max)
            };
            for direction in &directions {
                let point = middle + length * direction;
                let (distance, gradient) = hull.distance(&point);
                prop_assert!((gradient.norm() - 1.0).abs() < 1e-9);
                // All points are behind the plane at this distance: outside, no point is nearer.
                let slack = 1e-6 * length;
                prop_assert!(reach(&gradient, &point) <= slack - distance, "{distance} {}", reach(&gradient, &point));
                // The surface is where the distance says: inside, no point of the surface is nearer.
                let (at_it, _) = hull.distance(&(point - distance * gradient));
                prop_assert!(at_it.abs() <= slack, "{distance} {at_it}");
                for other in directions.iter().filter_map(|other| other.try_normalize(1e-3)) {
                    prop_assert!(reach(&other, &point) >= -distance - slack || distance > 0.0);
                }
            }
        }
    }

    #[test]
    fn points_in_a_plane_have_no_hull() {
        let x = Vector3::x();
        assert_eq!(Hull::of(&[]), None);
        assert_eq!(Hull::of(&[x; 100]), None);
        assert_eq!(Hull::of(&[x, 2.0 * x, 3.0 * x, 5.0 * x]), None);
        let square =
            |z: f64| [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, z]].map(Vector3::from);
        assert_eq!(Hull::of(&square(1e-9)), None);
        assert_eq!(Hull::of(&square(0.5).map(|point| 1e-6 * point)), None);
        // The corners of a floor that is 1 km long and 2 mm thick.
        assert!(Hull::of(&square(2e-6).map(|point| 1000.0 * point)).is_some());
    }

    #[test]
    fn a_box_is_the_hull_of_its_corners() {
        let signs = |i: usize| Vector3::from([1, 2, 4].map(|bit| if i & bit > 0 { 1.0 } else { -1.0 }));
        let half = Vector3::new(0.2, 0.3, 0.4);
        let corners: Vec<_> = (0..8).map(|i| half.component_mul(&signs(i))).collect();
        let hull = Hull::of(&corners).unwrap();
        assert_eq!((hull.faces.len(), hull.triangles().count(), hull.edges().count()), (6, 12, 12));
        let boxed = Shape::Box { base_from_box: nalgebra::Isometry3::identity(), half };
        for i in 0..1000 {
            let at = |by: f64| 0.6 * (by * f64::from(i)).sin();
            let point = Vector3::new(at(1.1), at(2.3), at(3.7));
            let (distance, gradient) = hull.distance(&point);
            let (expected, normal) = boxed.distance(&point);
            assert!((distance - expected).abs() < 1e-12 && (gradient - normal).norm() < 1e-9, "{point}");
        }
    }
}
