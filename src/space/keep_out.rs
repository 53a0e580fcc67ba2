//! What the arm must keep out of, and how it is written.

use super::{Name, NameError, Segment, Shape};
use crate::dq::{Line, Plane, unit_rotation};
use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion, Vector3};
use std::str::FromStr;
use thiserror::Error;

/// A solid that the arm must keep out of.
///
/// It is written as a name, a shape and its numbers, in the base frame, metres: `table half_space 0 0 1 0.02` is all that is below 2 cm,
/// by the normal and the offset along it; `ball sphere x y z radius`; `crate box x y z`, then the three lengths; `pipe cylinder x y z radius
/// length` along z; `beam capsule x y z radius length` along z, without its round ends. After box, cylinder and capsule an orientation may
/// follow, `qx qy qz qw`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KeepOut {
    /// What it is called.
    pub name: Name,
    /// Where it is and how large.
    pub shape: Shape,
}

/// What is no [`KeepOut`].
#[derive(Clone, Debug, Error, PartialEq)]
pub enum KeepOutError {
    /// A name that cannot be one.
    #[error(transparent)]
    Name(#[from] NameError),
    /// A shape that there is not.
    #[error(
        "{0:?} is no shape: expected a name, then one of half_space, sphere, box, cylinder, capsule, then numbers"
    )]
    Shape(String),
    /// Not as many numbers as the shape has, or something else among them.
    #[error("expected after {shape}: {expected}")]
    Numbers {
        /// The shape.
        shape: String,
        /// Its numbers.
        expected: &'static str,
    },
    /// A length that cannot be one.
    #[error("{0} is no length: expected more than 0, 1000 m at most")]
    Length(f64),
    /// A place that is too far away.
    #[error("{0} is too far away: expected 1000 m at most")]
    Far(f64),
    /// A direction or an orientation that is none.
    #[error("expected a direction of any length above 0, and an orientation of length 1")]
    Direction,
}

/// No place is farther away, and nothing longer \[m\].
const FARTHEST: f64 = 1000.0;

/// The shapes by their names, with their numbers.
const SHAPES: [(&str, usize, &str); 5] = [
    ("half_space", 4, "normal x y z, offset along it"),
    ("sphere", 4, "x y z radius"),
    ("box", 6, "x y z, three lengths, and an orientation qx qy qz qw or none"),
    ("cylinder", 5, "x y z radius length, and an orientation qx qy qz qw or none"),
    ("capsule", 5, "x y z radius length, and an orientation qx qy qz qw or none"),
];

impl FromStr for KeepOut {
    type Err = KeepOutError;

    fn from_str(text: &str) -> Result<Self, KeepOutError> {
        let mut words = text.split_whitespace();
        let name = words.next().unwrap_or_default().parse()?;
        let kind = words.next().unwrap_or_default();
        let known = SHAPES.iter().find(|(name, ..)| *name == kind);
        let (shape, count, expected) =
            known.ok_or_else(|| KeepOutError::Shape(crate::text::cut(text).into_owned()))?;
        let wrong = || KeepOutError::Numbers { shape: (*shape).to_owned(), expected };
        let numbers: Result<Vec<f64>, _> = words.map(str::parse).collect();
        let numbers = numbers.map_err(|_| wrong())?;
        let may_be_turned = *count > 4;
        let is_right = numbers.len() == *count || (may_be_turned && numbers.len() == count + 4);
        if !is_right || numbers.iter().any(|number| !number.is_finite()) {
            return Err(wrong());
        }
        let (numbers, turn) = numbers.split_at(*count);
        Ok(Self { name, shape: self::shape(shape, numbers, turn)? })
    }
}

/// The shape of that name with as many numbers as it has.
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
    /// The shape of that name, but no half-space, with its middle and its axes in `frame` and as many sizes as it has \[m\].
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
                Self::Capsule { core: Segment { ends: [center - half, center + half] }, radius: *radius }
            }
            _ => Self::Sphere { center, radius: sizes[0] },
        }
    }
}
