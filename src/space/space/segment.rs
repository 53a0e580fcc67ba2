//! Line segments, such as the axes of capsules.

use super::Gap;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};

/// The line segment between two points \[m\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// The two ends.
    pub ends: [Vector3<f64>; 2],
}

/// Two points at most this far apart \[m\] count as one point. The direction between them is then arbitrary.
const TOGETHER: f64 = 1e-12;

impl Segment {
    /// Returns a lower bound of the gap between this segment and a convex shape, computed from the `gap` between another segment and
    /// the same shape. The plane through `gap.other` with the normal of `gap` has the whole shape behind it. So this segment is at least
    /// as far from the shape as from this plane.
    pub(super) fn gap_at_least(&self, gap: &Gap) -> Gap {
        let beyond = |point: &Vector3<f64>| gap.distance + gap.normal.dot(&(point - gap.point));
        let [one, other] = self.ends.map(|end| (beyond(&end), end));
        let (distance, point) = if one.0 < other.0 { one } else { other };
        Gap { distance, normal: gap.normal, point, other: point - distance * gap.normal }
    }

    /// Creates the segment from `center - half` to `center + half` \[m\].
    pub fn about(center: &Vector3<f64>, half: &Vector3<f64>) -> Self {
        Self { ends: [center - half, center + half] }
    }

    /// Returns the point at the fraction `part` of the way from the first end to the second end.
    pub fn at(&self, part: f64) -> Vector3<f64> {
        self.ends[0] + part * self.vector()
    }

    /// Returns the vector from the first end to the second.
    pub fn vector(&self) -> Vector3<f64> {
        self.ends[1] - self.ends[0]
    }

    /// Returns a frame at the segment's middle. Its z axis points from the first end to the second end.
    pub fn frame(&self) -> Isometry3<f64> {
        let about_x = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
        let turn = UnitQuaternion::rotation_between(&Vector3::z(), &self.vector()).unwrap_or(about_x);
        Isometry3::from_parts(self.at(0.5).into(), turn)
    }

    /// Finds the point of the segment that is nearest to `point`. Returns its place from 0 (the first end) to 1 (the second end).
    fn part_near(&self, point: &Vector3<f64>) -> f64 {
        let along = self.vector();
        let length = along.norm_squared();
        if length > 0.0 { ((point - self.ends[0]).dot(&along) / length).clamp(0.0, 1.0) } else { 0.0 }
    }

    /// Returns the gap between `point` and the nearest point of this segment.
    pub fn gap_of(&self, point: &Vector3<f64>) -> Gap {
        between(point, &self.at(self.part_near(point)))
    }

    /// Returns the gap between the nearest points of this segment and of `other` (Ericson, Real-Time Collision Detection, 2005,
    /// §5.1.9).
    pub fn gap_to(&self, other: &Self) -> Gap {
        let (one, two, apart) = (self.vector(), other.vector(), self.ends[0] - other.ends[0]);
        let (a, e, b) = (one.norm_squared(), two.norm_squared(), one.dot(&two));
        let square = a * e - b * b;
        let part = if square > f64::EPSILON * a * e {
            ((b * two.dot(&apart) - one.dot(&apart) * e) / square).clamp(0.0, 1.0)
        } else {
            0.0
        };
        // If the lines are nearly parallel, rounding makes the point arbitrary. Projecting back and forth once finds a nearest
        // point.
        let there = other.part_near(&self.at(part));
        let here = self.part_near(&other.at(there));
        let there = other.part_near(&self.at(here));
        between(&self.at(here), &other.at(there))
    }
}

/// Returns the gap between two points.
fn between(point: &Vector3<f64>, other: &Vector3<f64>) -> Gap {
    let offset = point - other;
    let distance = offset.norm();
    let normal = if distance > TOGETHER { offset / distance } else { Vector3::z() };
    Gap { distance, normal, point: *point, other: *other }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn segment() -> impl Strategy<Value = Segment> {
        let point = || prop::array::uniform3(-1.0..1.0f64).prop_map(Vector3::from);
        // Some segments are points, and some are parallel to an axis.
        let end = (point(), point(), 0..4usize).prop_map(|(from, to, kind)| match kind {
            0 => [from, from],
            1 => [from, from + Vector3::x()],
            _ => [from, to],
        });
        end.prop_map(|ends| Segment { ends })
    }

    proptest! {
        #[test]
        fn no_points_of_two_segments_are_nearer_than_the_gap(one in segment(), other in segment()) {
            let gap = one.gap_to(&other);
            let parts = || (0..=20).map(|i| f64::from(i) / 20.0);
            for (here, there) in parts().flat_map(|here| parts().map(move |there| (here, there))) {
                prop_assert!((one.at(here) - other.at(there)).norm() >= gap.distance - 1e-9);
            }
            prop_assert!(((gap.point - gap.other).norm() - gap.distance).abs() < 1e-12);
            prop_assert!((one.gap_of(&gap.point).distance).abs() < 1e-9 && other.gap_of(&gap.other).distance < 1e-9);
            prop_assert!((other.gap_to(&one).distance - gap.distance).abs() < 1e-9);
        }
    }
}
