//! Solids, given by their sizes, as in parameters and messages.

use super::hull::FLAT;
use super::name::NameError;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use std::fmt;
use std::str::FromStr;
use thiserror::Error;

/// The reason why a solid is not valid as a [`KeepOut`](super::KeepOut).
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum KeepOutError {
    /// The name is not valid.
    Name(#[from] NameError),
    /// The name of the shape is unknown.
    Shape,
    /// The count of numbers does not match the shape, or a number is not finite.
    Numbers {
        /// The name of the shape.
        shape: &'static str,
        /// The description of the shape's numbers.
        numbers: &'static str,
    },
    /// This length of the solid is not valid.
    Length(f64),
    /// A position has this coordinate, which lies outside ±1 km \[m\].
    Far(f64),
    /// A direction or an orientation is invalid.
    Direction,
    /// The points lie in a plane.
    Flat,
}

impl KeepOutError {
    /// Returns a description of a valid value, for the error message.
    pub fn expected(&self) -> String {
        match self {
            Self::Name(why) => why.expected(),
            Self::Shape => {
                format!(
                    "a name, then {}, then its numbers",
                    Solid::SHAPES.map(|(shape, _)| shape).join(" or ")
                )
            }
            Self::Numbers { shape, numbers } => format!("finite numbers after {shape}: {numbers}"),
            Self::Length(length) => format!("lengths of more than 0 m, {FARTHEST} m at most, not {length}"),
            Self::Far(place) => format!("a place no farther away than {FARTHEST} m, not {place}"),
            Self::Direction => "a direction of any length above 0, and an orientation of length 1".to_owned(),
            Self::Flat => {
                format!("points that do not lie in a plane, within {FLAT} m or {FLAT} of their distance")
            }
        }
    }
}

impl fmt::Display for KeepOutError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "expected {}", self.expected())
    }
}

/// Largest distance of a position from the origin, and largest length \[m\].
pub(super) const FARTHEST: f64 = 1000.0;

/// The orientation qx qy qz qw of a solid that is not rotated.
pub const NO_TURN: [f64; 4] = [0.0, 0.0, 0.0, 1.0];

/// A solid in its own reference frame, given by its sizes in meters.
///
/// The text form is the name of the shape followed by its numbers:
///
/// - `half_space` and the normal `x y z`, then the offset along it: `half_space 0 0 1 0.02` is everything below 2 cm.
/// - `sphere x y z radius`
/// - `box x y z` and three lengths
/// - `cylinder x y z radius length`, along z
/// - `capsule x y z radius length`, along z; the length excludes the round ends.
/// - `hull x y z x y z ...`, the convex hull of 4 to 100 points
///
/// An orientation `qx qy qz qw` may follow the numbers of a box, a cylinder or a capsule.
#[derive(Clone, Debug, PartialEq)]
pub enum Solid {
    /// All points behind a plane.
    HalfSpace {
        /// The outward direction. Its length does not matter.
        normal: Vector3<f64>,
        /// The distance of the plane from the origin along the normal \[m\].
        offset: f64,
    },
    /// A ball.
    Sphere {
        /// The center of the ball \[m\].
        center: Vector3<f64>,
        /// The radius of the ball \[m\].
        radius: f64,
    },
    /// A box.
    Box {
        /// The center of the box \[m\].
        center: Vector3<f64>,
        /// The orientation of the edges, qx qy qz qw.
        turn: [f64; 4],
        /// The lengths of the edges \[m\].
        lengths: Vector3<f64>,
    },
    /// A cylinder along its own z axis.
    Cylinder {
        /// The center of the cylinder \[m\].
        center: Vector3<f64>,
        /// The orientation of the cylinder, qx qy qz qw.
        turn: [f64; 4],
        /// The radius of the cylinder \[m\].
        radius: f64,
        /// The length of the cylinder \[m\].
        length: f64,
    },
    /// All points within a radius of a segment along the capsule's own z axis.
    Capsule {
        /// The center of the segment \[m\].
        center: Vector3<f64>,
        /// The orientation of the capsule, qx qy qz qw.
        turn: [f64; 4],
        /// The radius of the capsule \[m\].
        radius: f64,
        /// The length of the segment \[m\].
        length: f64,
    },
    /// The convex hull of points.
    Hull {
        /// The points \[m\].
        points: Vec<Vector3<f64>>,
    },
}

impl Solid {
    /// The names of the shapes, each with the description of its numbers.
    pub(super) const SHAPES: [(&str, &str); 6] = [
        ("half_space", "normal x y z, offset along it"),
        ("sphere", "x y z radius"),
        ("box", "x y z, three lengths, and an orientation qx qy qz qw or none"),
        ("cylinder", "x y z radius length, and an orientation qx qy qz qw or none"),
        ("capsule", "x y z radius length, and an orientation qx qy qz qw or none"),
        ("hull", "x y z of 4 to 100 points"),
    ];

    /// Returns the name of the solid's shape.
    pub fn name(&self) -> &'static str {
        let number = match self {
            Self::HalfSpace { .. } => 0,
            Self::Sphere { .. } => 1,
            Self::Box { .. } => 2,
            Self::Cylinder { .. } => 3,
            Self::Capsule { .. } => 4,
            Self::Hull { .. } => 5,
        };
        Self::SHAPES[number].0
    }

    /// Returns the error for numbers that do not match the shape.
    pub(super) fn wrong_numbers(&self) -> KeepOutError {
        wrong_numbers(self.name())
    }

    /// Returns the solid moved by the transform `by`.
    pub fn moved(&self, by: &Isometry3<f64>) -> Self {
        let place = |point: &Vector3<f64>| by.rotation * point + by.translation.vector;
        let mut moved = self.clone();
        match &mut moved {
            Self::HalfSpace { normal, offset } => {
                *normal = by.rotation * *normal;
                *offset += normal.normalize().dot(&by.translation.vector);
            }
            Self::Sphere { center, .. } => *center = place(center),
            Self::Box { center, turn, .. }
            | Self::Cylinder { center, turn, .. }
            | Self::Capsule { center, turn, .. } => {
                *center = place(center);
                let own = UnitQuaternion::new_unchecked((*turn).into());
                *turn = (by.rotation * own).coords.into();
            }
            Self::Hull { points } => {
                points.iter_mut().for_each(|point| *point = place(point));
            }
        }
        moved
    }

    /// Returns the solid's numbers, in the order of the text form.
    fn numbers(&self) -> Vec<f64> {
        let of =
            |center: &Vector3<f64>, sizes: &[f64], turn: &[f64]| [center.as_slice(), sizes, turn].concat();
        match self {
            Self::HalfSpace { normal, offset } => of(normal, &[*offset], &[]),
            Self::Sphere { center, radius } => of(center, &[*radius], &[]),
            Self::Box { center, turn, lengths } => of(center, lengths.as_slice(), turn),
            Self::Cylinder { center, turn, radius, length }
            | Self::Capsule { center, turn, radius, length } => of(center, &[*radius, *length], turn),
            Self::Hull { points } => points.iter().flatten().copied().collect(),
        }
    }
}

fn wrong_numbers(shape: &str) -> KeepOutError {
    match Solid::SHAPES.into_iter().find(|(name, _)| *name == shape) {
        Some((shape, numbers)) => KeepOutError::Numbers { shape, numbers },
        None => KeepOutError::Shape,
    }
}

impl FromStr for Solid {
    type Err = KeepOutError;

    fn from_str(text: &str) -> Result<Self, KeepOutError> {
        let mut words = text.split_whitespace();
        let shape = words.next().unwrap_or_default();
        let numbers = words.map(str::parse).collect::<Result<Vec<f64>, _>>().unwrap_or_default();
        let turn = |turn: &[f64]| if turn.is_empty() { Some(NO_TURN) } else { turn.try_into().ok() };
        let solid = || match (shape, &numbers[..]) {
            ("half_space", &[x, y, z, offset]) => {
                Some(Self::HalfSpace { normal: Vector3::new(x, y, z), offset })
            }
            ("sphere", &[x, y, z, radius]) => Some(Self::Sphere { center: Vector3::new(x, y, z), radius }),
            ("box", &[x, y, z, a, b, c, ref turned @ ..]) => Some(Self::Box {
                center: Vector3::new(x, y, z),
                turn: turn(turned)?,
                lengths: Vector3::new(a, b, c),
            }),
            ("cylinder", &[x, y, z, radius, length, ref turned @ ..]) => {
                Some(Self::Cylinder { center: Vector3::new(x, y, z), turn: turn(turned)?, radius, length })
            }
            ("capsule", &[x, y, z, radius, length, ref turned @ ..]) => {
                Some(Self::Capsule { center: Vector3::new(x, y, z), turn: turn(turned)?, radius, length })
            }
            ("hull", all) if all.len().is_multiple_of(3) => {
                Some(Self::Hull { points: all.chunks_exact(3).map(Vector3::from_column_slice).collect() })
            }
            _ => None,
        };
        let is_finite = numbers.iter().all(|number| number.is_finite());
        solid().filter(|_| is_finite).ok_or_else(|| wrong_numbers(shape))
    }
}

impl fmt::Display for Solid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())?;
        self.numbers().iter().try_for_each(|number| write!(f, " {number}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::space::KeepOut;
    use nalgebra::Point3;
    use proptest::prelude::*;

    fn numbers() -> impl Strategy<Value = [f64; 10]> {
        prop::array::uniform10(-9.0..9.0f64)
    }

    proptest! {
        /// Bags record keep-outs as text, so numbers read from the text must equal the original to the last bit.
        #[test]
        fn the_text_form_is_exact(numbers in numbers(), turn in prop::array::uniform4(-1.0..1.0f64)) {
            let [x, y, z, a, b, c, ..] = numbers;
            let center = Vector3::new(x, y, z);
            let turn: [f64; 4] = UnitQuaternion::new_normalize(turn.into()).coords.into();
            for solid in [
                Solid::HalfSpace { normal: center, offset: a },
                Solid::Sphere { center, radius: a },
                Solid::Box { center, turn, lengths: Vector3::new(a, b, c) },
                Solid::Cylinder { center, turn, radius: a, length: b },
                Solid::Capsule { center, turn, radius: a, length: b },
                Solid::Hull { points: vec![center, Vector3::new(a, b, c), Vector3::x(), Vector3::zeros()] },
            ] {
                prop_assert_eq!(solid.to_string().parse(), Ok(solid));
            }
        }

        #[test]
        fn a_moved_solid_keeps_its_distance_from_points_that_move_with_it(numbers in numbers(), at in prop::array::uniform3(-3.0..3.0f64)) {
            let [x, y, z, a, b, c, d, e, f, g] = numbers;
            let by = Isometry3::new(Vector3::new(a, b, c), Vector3::new(d, e, f));
            let point = Vector3::from(at);
            let moved = (by * Point3::from(point)).coords;
            let size = g.abs() + 0.1;
            for text in [
                format!("half_space {x} {y} {z} {g}"),
                format!("sphere {x} {y} {z} {size}"),
                format!("box {x} {y} {z} {size} 1 2 0.6 0 0 0.8"),
                format!("cylinder {x} {y} {z} {size} 1 0.6 0 0 0.8"),
                format!("capsule {x} {y} {z} {size} 1 0.6 0 0 0.8"),
                format!("hull {x} {y} {z} 9 0 0 0 {size} 0 0 0 20"),
            ] {
                let solid: Solid = text.parse().unwrap();
                let name = || "it".parse().unwrap();
                let (Ok(here), Ok(there)) = (KeepOut::new(name(), solid.clone()), KeepOut::new(name(), solid.moved(&by))) else {
                    continue;
                };
                let (before, after) = (here.shape.distance(&point).0, there.shape.distance(&moved).0);
                prop_assert!((before - after).abs() < 1e-9, "{}: {} {}", text, before, after);
            }
        }
    }
}
