//! What the arm must keep out of, or its tool stay in, and how it is written.

use super::hull::FLAT;
use super::{Hull, Name, NameError, Segment, Shape};
use dq_algebra::{Line, Plane, unit_rotation};
use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion, Vector3};
use std::fmt;
use std::str::FromStr;
use thiserror::Error;

/// A solid that the arm must keep out of, or that its tool must stay in.
///
/// It is written as a name, a shape and its numbers, in the base frame, metres: `table half_space 0 0 1 0.02` is all that is below 2 cm,
/// by the normal and the offset along it; `ball sphere x y z radius`; `crate box x y z`, then the three lengths; `pipe cylinder x y z radius
/// length` along z; `beam capsule x y z radius length` along z, without its round ends; after these three an orientation may follow,
/// `qx qy qz qw`; `wedge hull x y z x y z ...` is the convex hull of 4 to 100 points.
#[derive(Clone, Debug, PartialEq)]
pub struct KeepOut {
    /// What it is called.
    pub name: Name,
    /// Where it is and how large.
    pub shape: Shape,
}

/// Why a text is no [`KeepOut`].
#[derive(Clone, Debug, Error, PartialEq)]
pub enum KeepOutError {
    /// A name that cannot be one.
    Name(#[from] NameError),
    /// A shape that there is not.
    Shape,
    /// Not as many numbers as the shape has, or something else among them.
    Numbers {
        /// The shape.
        shape: &'static str,
        /// Its numbers.
        numbers: &'static str,
    },
    /// A length that cannot be one.
    Length(f64),
    /// A place that is too far away.
    Far(f64),
    /// A direction or an orientation that is none.
    Direction,
    /// Points that lie in a plane.
    Flat,
}

impl KeepOutError {
    /// What would be right.
    pub fn expected(&self) -> String {
        match self {
            Self::Name(why) => why.expected(),
            Self::Shape => {
                format!("a name, then {}, then its numbers", SHAPES.map(|(shape, ..)| shape).join(" or "))
            }
            Self::Numbers { shape, numbers } => format!("finite numbers after {shape}: {numbers}"),
            Self::Length(length) => format!("lengths of more than 0 m, {FARTHEST} m at most, not {length}"),
            Self::Far(place) => format!("a place no farther away than {FARTHEST} m, not {place}"),
            Self::Direction => "a direction of any length above 0, and an orientation of length 1".to_owned(),
            Self::Flat => format!(
                "points that do not lie in a plane, not even within {FLAT} m or {FLAT} of their distance"
            ),
        }
    }
}

impl fmt::Display for KeepOutError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "expected {}", self.expected())
    }
}

/// No place is farther away, and nothing longer \[m\].
const FARTHEST: f64 = 1000.0;

/// A hull is made of so many points at most: it has less than twice as many faces, and all of them may bound a velocity at once.
const MOST_POINTS: usize = 100;

/// The shapes by their names, with their numbers.
const SHAPES: [(&str, usize, &str); 6] = [
    ("half_space", 4, "normal x y z, offset along it"),
    ("sphere", 4, "x y z radius"),
    ("box", 6, "x y z, three lengths, and an orientation qx qy qz qw or none"),
    ("cylinder", 5, "x y z radius length, and an orientation qx qy qz qw or none"),
    ("capsule", 5, "x y z radius length, and an orientation qx qy qz qw or none"),
    ("hull", 12, "x y z of 4 to 100 points"),
];

impl FromStr for KeepOut {
    type Err = KeepOutError;

    fn from_str(text: &str) -> Result<Self, KeepOutError> {
        let mut words = text.split_whitespace();
        let name = words.next().unwrap_or_default().parse()?;
        let kind = words.next().unwrap_or_default();
        let known = SHAPES.iter().find(|(name, ..)| *name == kind);
        let (shape, count, expected) = known.ok_or(KeepOutError::Shape)?;
        let wrong = || KeepOutError::Numbers { shape, numbers: expected };
        let numbers: Result<Vec<f64>, _> = words.map(str::parse).collect();
        let numbers = numbers.map_err(|_| wrong())?;
        let is_right = match (*shape, numbers.len()) {
            ("hull", given) => given >= *count && given <= 3 * MOST_POINTS && given.is_multiple_of(3),
            (_, given) => given == *count || (*count > 4 && given == count + 4),
        };
        if !is_right || numbers.iter().any(|number| !number.is_finite()) {
            return Err(wrong());
        }
        let shape = if *shape == "hull" {
            hull(&numbers)?
        } else {
            let (numbers, turn) = numbers.split_at(*count);
            self::shape(shape, numbers, turn)?
        };
        Ok(Self { name, shape })
    }
}

/// The hull of the points that have these coordinates.
fn hull(numbers: &[f64]) -> Result<Shape, KeepOutError> {
    numbers.iter().try_for_each(|number| place(*number))?;
    let points: Vec<_> = numbers.chunks_exact(3).map(Vector3::from_column_slice).collect();
    Hull::of(&points).map(Shape::Hull).ok_or(KeepOutError::Flat)
}

/// The shape of that name, but no hull, with as many numbers as it has.
fn shape(kind: &str, numbers: &[f64], turn: &[f64]) -> Result<Shape, KeepOutError> {
    let at = Vector3::new(numbers[0], numbers[1], numbers[2]);
    if kind == "half_space" {
        let normal = Unit::try_new(at, f64::MIN_POSITIVE).ok_or(KeepOutError::Direction)?;
        place(numbers[3])?;
        return Ok(Shape::HalfSpace(Plane::new(&normal, &(numbers[3] * normal.into_inner()))));
    }
    at.iter().try_for_each(|number| place(*number))?;
    let sizes = &numbers[3..];
    if let Some(wrong) = sizes.iter().find(|size| !(**size > 0.0 && **size <= FARTHEST)) {
        return Err(KeepOutError::Length(*wrong));
    }
    let rotation = match turn {
        [x, y, z, w] => unit_rotation([*x, *y, *z, *w]).map_err(|_| KeepOutError::Direction)?,
        _ => UnitQuaternion::identity(),
    };
    Ok(Shape::at(kind, &Isometry3::from_parts(Translation3::from(at), rotation), sizes))
}

fn place(number: f64) -> Result<(), KeepOutError> {
    if number.abs() <= FARTHEST { Ok(()) } else { Err(KeepOutError::Far(number)) }
}

impl Shape {
    /// The shape of that name, but no half-space and no hull, with its middle and its axes in `frame` and as many sizes as it has \[m\].
    fn at(kind: &str, frame: &Isometry3<f64>, sizes: &[f64]) -> Self {
        let center = frame.translation.vector;
        let axis = frame.rotation * Vector3::z();
        match (kind, sizes) {
            ("box", [x, y, z]) => Self::Box { base_from_box: *frame, half: 0.5 * Vector3::new(*x, *y, *z) },
            ("cylinder", [radius, length]) => Self::Cylinder {
                axis: Line::new(&Unit::new_normalize(axis), &center),
                center,
                radius: *radius,
                half_length: 0.5 * length,
            },
            ("capsule", [radius, length]) => {
                let half = 0.5 * *length * axis;
                Self::Capsule { core: Segment::about(&center, &half), radius: *radius }
            }
            _ => Self::Sphere { center, radius: sizes[0] },
        }
    }
}
