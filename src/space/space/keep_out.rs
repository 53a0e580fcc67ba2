//! Keep-outs of the arm, and keep-ins of its tool.

use super::solid::{FARTHEST, KeepOutError};
use super::{Hull, Name, Segment, Shape, Solid};
use dq_algebra::{Line, Plane, unit_rotation};
use nalgebra::{Isometry3, Translation3, Unit, Vector3};
use std::fmt;
use std::ops::RangeInclusive;
use std::str::FromStr;

/// A named solid that the arm must stay clear of, or that its tool must stay in.
///
/// Its text form is the name followed by the text of the [`Solid`]: `table half_space 0 0 1 0.02`.
#[derive(Clone, Debug, PartialEq)]
pub struct KeepOut {
    /// The name, as in reports.
    pub name: Name,
    /// The shape in the base frame.
    pub shape: Shape,
    solid: Solid,
}

/// The allowed number of points of a hull. The limit bounds the computation, because each face of the hull may constrain a
/// velocity. A hull has fewer than twice as many faces as points.
const POINTS: RangeInclusive<usize> = 4..=100;

impl KeepOut {
    /// Creates a keep-out from a solid in the base frame and a name.
    ///
    /// # Errors
    /// [`KeepOutError`] for an invalid solid.
    pub fn new(name: Name, solid: Solid) -> Result<Self, KeepOutError> {
        let shape = shape(&solid)?;
        Ok(Self { name, shape, solid })
    }

    /// Returns the solid of the keep-out.
    pub fn solid(&self) -> &Solid {
        &self.solid
    }
}

impl FromStr for KeepOut {
    type Err = KeepOutError;

    fn from_str(text: &str) -> Result<Self, KeepOutError> {
        let (name, solid) = text.trim_start().split_once(char::is_whitespace).unwrap_or((text.trim(), ""));
        Self::new(name.parse()?, solid.parse()?)
    }
}

/// Writes the text form. Parsing this text restores exactly the same numbers.
impl fmt::Display for KeepOut {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.name, self.solid)
    }
}

/// Returns the shape of a solid, if the solid is valid.
fn shape(solid: &Solid) -> Result<Shape, KeepOutError> {
    match solid {
        Solid::HalfSpace { normal, offset } => {
            let normal = Unit::try_new(*normal, f64::MIN_POSITIVE).ok_or(KeepOutError::Direction)?;
            check_place(*offset)?;
            Ok(Shape::HalfSpace(Plane::new(&normal, &(*offset * normal.into_inner()))))
        }
        Solid::Sphere { center, radius } => {
            center.iter().try_for_each(|place| check_place(*place))?;
            check_length(*radius)?;
            Ok(Shape::Sphere { center: *center, radius: *radius })
        }
        Solid::Box { center, turn, lengths } => {
            let base_from_box = frame(center, turn)?;
            lengths.iter().try_for_each(|length| check_length(*length))?;
            Ok(Shape::Box { base_from_box, half: 0.5 * lengths })
        }
        Solid::Cylinder { center, turn, radius, length } => {
            let axis = axis(center, turn, [*radius, *length])?;
            let (center, line) = (*center, Line::new(&Unit::new_normalize(axis), center));
            Ok(Shape::Cylinder { axis: line, center, radius: *radius, half_length: 0.5 * length })
        }
        Solid::Capsule { center, turn, radius, length } => {
            let half = 0.5 * *length * axis(center, turn, [*radius, *length])?;
            Ok(Shape::Capsule { core: Segment::about(center, &half), radius: *radius })
        }
        Solid::Hull { points } => {
            if !POINTS.contains(&points.len()) {
                return Err(solid.wrong_numbers());
            }
            points.iter().flatten().try_for_each(|place| check_place(*place))?;
            Hull::of(points).map(Shape::Hull).ok_or(KeepOutError::Flat)
        }
    }
}

/// Returns the frame of a solid with its center at `center` and the orientation `turn`.
fn frame(center: &Vector3<f64>, turn: &[f64; 4]) -> Result<Isometry3<f64>, KeepOutError> {
    center.iter().try_for_each(|place| check_place(*place))?;
    let rotation = unit_rotation(*turn).map_err(|_| KeepOutError::Direction)?;
    Ok(Isometry3::from_parts(Translation3::from(*center), rotation))
}

/// Returns the direction of the axis of a cylinder or a capsule.
fn axis(center: &Vector3<f64>, turn: &[f64; 4], sizes: [f64; 2]) -> Result<Vector3<f64>, KeepOutError> {
    let frame = frame(center, turn)?;
    sizes.into_iter().try_for_each(check_length)?;
    Ok(frame.rotation * Vector3::z())
}

fn check_place(number: f64) -> Result<(), KeepOutError> {
    if number.abs() <= FARTHEST { Ok(()) } else { Err(KeepOutError::Far(number)) }
}

fn check_length(length: f64) -> Result<(), KeepOutError> {
    if length > 0.0 && length <= FARTHEST { Ok(()) } else { Err(KeepOutError::Length(length)) }
}
