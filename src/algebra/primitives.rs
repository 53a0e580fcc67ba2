//! Planes and lines as dual quaternions (Adorno 2017; Marinho et al., T-RO 2019, §IV), and the distances of points from them.

use super::{DualQuaternion, UnitDualQuaternion};
use nalgebra::{Quaternion, Unit, Vector3};

/// A plane `n + ε d`: all points p with `n·p = d`. The distance of a point is positive on the side to which n points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane(DualQuaternion);

impl Plane {
    /// Creates the plane perpendicular to `normal` through `point` \[m\].
    pub fn new(normal: &Unit<Vector3<f64>>, point: &Vector3<f64>) -> Self {
        let real = Quaternion::from_imag(normal.into_inner());
        Self(DualQuaternion { real, dual: Quaternion::from_real(normal.dot(point)) })
    }

    /// Returns the normal `n`, of unit length.
    pub fn normal(&self) -> Vector3<f64> {
        self.0.real.imag()
    }

    /// Returns the signed distance of the plane from the origin along the normal \[m\].
    pub fn offset(&self) -> f64 {
        self.0.dual.w
    }

    /// Converts the plane π to the base frame: `q̄ π q*`. Here `q` is `base_from_plane`, and `q̄` is `q` with its dual part
    /// negated.
    pub fn moved(&self, base_from_plane: &UnitDualQuaternion) -> Self {
        let q = *base_from_plane.as_dual_quaternion();
        let other = DualQuaternion { dual: -q.dual, ..q };
        Self(other * self.0 * q.conjugate())
    }

    /// Returns the signed distance `n·p − d` of `point` \[m\]. Its gradient is the normal.
    pub fn distance(&self, point: &Vector3<f64>) -> f64 {
        self.normal().dot(point) - self.offset()
    }
}

/// A line `l + ε m` in Plücker coordinates. Its direction is l, and its moment is `m = p × l` for any of its points p.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line(DualQuaternion);

impl Line {
    /// Creates the line along `direction` through `point` \[m\].
    pub fn new(direction: &Unit<Vector3<f64>>, point: &Vector3<f64>) -> Self {
        let real = Quaternion::from_imag(direction.into_inner());
        Self(DualQuaternion { real, dual: Quaternion::from_imag(point.cross(direction)) })
    }

    /// Returns the direction `l`, of unit length.
    pub fn direction(&self) -> Vector3<f64> {
        self.0.real.imag()
    }

    /// Returns the moment of the line \[m\].
    pub fn moment(&self) -> Vector3<f64> {
        self.0.dual.imag()
    }

    /// Converts the line λ to the base frame: `q λ q*` with `q` = `base_from_line`.
    pub fn moved(&self, base_from_line: &UnitDualQuaternion) -> Self {
        let q = *base_from_line.as_dual_quaternion();
        Self(q * self.0 * q.conjugate())
    }

    /// Returns the vector from the line to `point` \[m\], perpendicular to the line: `l × (p × l − m)`. Its length is the distance
    /// of the point from the line, and its direction is the gradient of that distance.
    pub fn offset(&self, point: &Vector3<f64>) -> Vector3<f64> {
        let direction = self.direction();
        direction.cross(&(point.cross(&direction) - self.moment()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::UnitQuaternion;
    use proptest::prelude::*;

    fn vector() -> impl Strategy<Value = Vector3<f64>> {
        prop::array::uniform3(-2.0..2.0f64).prop_map(Vector3::from)
    }

    proptest! {
        #[test]
        fn what_moves_with_a_point_keeps_its_distance(turn in vector(), shift in vector(), way in vector(), at in vector(), p in vector()) {
            prop_assume!(way.norm() > 0.1);
            let (way, motion) = (Unit::new_normalize(way), UnitDualQuaternion::from_parts(UnitQuaternion::new(turn), shift));
            let moved = motion.transform_point(&nalgebra::Point3::from(p));
            let plane = Plane::new(&way, &at);
            prop_assert!((plane.distance(&p) - way.dot(&(p - at))).abs() < 1e-12);
            prop_assert!((plane.moved(&motion).distance(&moved.coords) - plane.distance(&p)).abs() < 1e-12);
            let line = Line::new(&way, &at);
            let square = (p - at) - way.into_inner() * way.dot(&(p - at));
            prop_assert!((line.offset(&p) - square).norm() < 1e-12);
            prop_assert!((line.moved(&motion).offset(&moved.coords) - motion.rotation() * square).norm() < 1e-12);
        }
    }
}
