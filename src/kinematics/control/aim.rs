//! The aim: the components of the tool's pose that a goal determines. The other components are free.

use super::angular_linear::{AngularLinear, first, twice};
use super::gram::Gram;
use crate::arm::ArmState;
use crate::arm::pair::{self, Motions};
use dq_algebra::UnitDualQuaternion;
use dq_common::named;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

named! {
    /// The aim: the components of the tool's pose that a goal determines. The other components are free: no law controls them.
    "task" Aim {
        /// The whole pose.
        Pose = "pose",
        /// The position of the tool point; the orientation of the tool is free.
        Position = "position",
        /// The position of the tool point, and the direction of the tool's z axis; rotation about that axis is free.
        PositionAndAxis = "position_and_axis",
        /// The orientation of the tool; the position of the tool point is free.
        Orientation = "orientation",
        /// The distance of the tool point from the base's origin, or, for two arms, the distance between their tools.
        Distance = "distance",
    }
}

/// A vector shorter than this counts as having no direction.
const NO_DIRECTION: f64 = 1e-12;

impl Aim {
    /// All aims, in the order of [`NAMES`](Self::NAMES).
    pub const ALL: [Self; 5] =
        [Self::Pose, Self::Position, Self::PositionAndAxis, Self::Orientation, Self::Distance];

    /// The names of the aims of two arms, in the order of [`ALL`](Self::ALL).
    pub const RELATIVE_NAMES: &'static [&'static str] = &[
        "relative_pose",
        "relative_position",
        "relative_position_and_axis",
        "relative_orientation",
        "relative_distance",
    ];

    /// Returns the number of components that the goal determines. An arm with more joints than this number is redundant.
    pub fn components(self) -> usize {
        match self {
            Self::Pose => 6,
            Self::PositionAndAxis => 5,
            Self::Position | Self::Orientation => 3,
            Self::Distance => 1,
        }
    }

    /// Returns the pose nearest to the tool's pose among the poses that meet the goal in the components of the aim. The rotation from
    /// the tool to that pose is the smallest possible.
    ///
    /// For [`PositionAndAxis`](Self::PositionAndAxis) the rotation is the shortest arc, in the plane of both z axes. If the z axes
    /// are opposite, it is a half turn about the tool's x axis.
    pub fn nearest(
        self,
        base_from_goal: &UnitDualQuaternion,
        base_from_tool: &UnitDualQuaternion,
    ) -> UnitDualQuaternion {
        let rotation = match self {
            Self::Pose => return *base_from_goal,
            Self::Orientation => base_from_goal.rotation(),
            Self::Position | Self::Distance => base_from_tool.rotation(),
            Self::PositionAndAxis => {
                let turn =
                    UnitQuaternion::new_normalize(self.turn(base_from_goal, &base_from_tool.rotation()));
                turn * base_from_tool.rotation()
            }
        };
        UnitDualQuaternion::from_parts(rotation, self.point(base_from_goal, &base_from_tool.translation()))
    }

    /// Returns the position of the [`nearest`](Self::nearest) pose \[m\] for a tool at `tool_point` \[m\].
    #[inline(always)]
    pub fn point(self, base_from_goal: &UnitDualQuaternion, tool_point: &Vector3<f64>) -> Vector3<f64> {
        match self {
            Self::Pose | Self::Position | Self::PositionAndAxis => base_from_goal.translation(),
            Self::Orientation => *tool_point,
            Self::Distance => direction(tool_point) * base_from_goal.translation().norm(),
        }
    }

    /// Returns the rotation from the tool's orientation `rotation` to the orientation of the [`nearest`](Self::nearest) pose,
    /// along the base's axes.
    #[inline(always)]
    pub(super) fn turn(
        self,
        base_from_goal: &UnitDualQuaternion,
        rotation: &UnitQuaternion<f64>,
    ) -> Quaternion<f64> {
        match self {
            Self::Pose | Self::Orientation => base_from_goal.real() * rotation.conjugate().into_inner(),
            Self::Position | Self::Distance => Quaternion::identity(),
            Self::PositionAndAxis => {
                let (now, wanted) = (rotation * Vector3::z(), base_from_goal.rotation() * Vector3::z());
                let middle = now + wanted;
                match middle.try_normalize(NO_DIRECTION) {
                    // The sum of the two unit vectors has the length 2 cos(½φ), and makes an angle of ½φ with each of them.
                    Some(between) => Quaternion::from_parts(0.5 * middle.norm(), now.cross(&between)),
                    None => Quaternion::from_imag(rotation * Vector3::x()),
                }
            }
        }
    }

    /// Returns the angle of the rotation from the tool to the [`nearest`](Self::nearest) pose \[rad\], from 0 to 2π. If the sign of
    /// the goal's quaternion demands the longer rotation, the angle exceeds π.
    pub fn angle(self, base_from_goal: &UnitDualQuaternion, base_from_tool: &UnitDualQuaternion) -> f64 {
        let turn = self.turn(base_from_goal, &base_from_tool.rotation());
        2.0 * turn.imag().norm().atan2(turn.w)
    }

    /// Returns the part of `twist` in the components that the aim determines. `twist` is `(ω, v)` [rad/s, m/s] of the tool of
    /// `arm`, along the base's axes.
    pub fn part_of(self, arm: &ArmState, twist: &AngularLinear) -> AngularLinear {
        let rows = self.rows(arm);
        first(&rows.twist(&twice(&rows.of(twist))))
    }

    /// Returns the aim's name for two arms. Their controlled pose is the pose of one tool relative to the other.
    pub fn relative_name(self) -> &'static str {
        Self::RELATIVE_NAMES[self as usize]
    }

    /// Returns the aim with this [`relative_name`](Self::relative_name); `None` if the name is unknown.
    pub fn from_relative_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|aim| aim.relative_name() == name)
    }

    /// Returns the rows of the tool's Jacobian that belong to the aim, at the pose of `arm`.
    pub(super) fn rows(self, arm: &ArmState) -> Rows {
        match self {
            Self::Pose => Rows::Pose,
            Self::Position => Rows::Position,
            Self::Orientation => Rows::Orientation,
            Self::Distance => Rows::Distance { along: direction(&arm.tool_point()) },
            Self::PositionAndAxis => {
                let rotation = arm.rotation();
                Rows::PositionAndAxis { across: [Vector3::x(), Vector3::y()].map(|axis| rotation * axis) }
            }
        }
    }
}

/// The rows of the tool's Jacobian that belong to an aim. A vector with one number per row is always stored as six numbers. Those
/// after the last row are unused.
///
/// - `Pose`: three angular rows, then three linear rows, along the base's axes.
/// - `Position`: three linear rows. `Orientation`: three angular rows.
/// - `PositionAndAxis`: three linear rows, then two angular rows, about the two axes perpendicular to the tool's z axis.
/// - `Distance`: one linear row, in the direction from the base's origin to the tool point.
pub(super) enum Rows {
    Pose,
    Position,
    PositionAndAxis { across: [Vector3<f64>; 2] },
    Orientation,
    Distance { along: Vector3<f64> },
}

impl Rows {
    /// Returns `J Jᵀ`, where J has only the rows of the aim. The unused rows of this 6×6 matrix are filled so that its smallest
    /// eigenvalue is that of the used rows.
    #[inline(always)]
    pub fn gram(&self, arm: &ArmState) -> Gram {
        match self {
            Self::Pose => Gram::of(arm),
            Self::Position | Self::Orientation => self.gram_of(arm).stiffened(3),
            Self::Distance { .. } => self.gram_of(arm).stiffened(1),
            Self::PositionAndAxis { .. } => self.gram_of(arm).stiffened(5),
        }
    }

    fn gram_of(&self, arm: &ArmState) -> Gram {
        Gram::of_columns(arm.joint_count(), arm.tool_motions().map(|column| self.of(&column)))
    }

    /// Converts a twist `(ω, v)` of the tool, along the base's axes, to a vector in these rows. The vector has one component of the
    /// twist for each row, then zeros.
    #[inline(always)]
    pub fn of(&self, (angular, linear): &AngularLinear) -> AngularLinear {
        match self {
            Self::Pose => (*angular, *linear),
            Self::Position => (*linear, Vector3::zeros()),
            Self::Orientation => (*angular, Vector3::zeros()),
            Self::Distance { along } => (Vector3::new(along.dot(linear), 0.0, 0.0), Vector3::zeros()),
            Self::PositionAndAxis { across: [x, y] } => {
                (*linear, Vector3::new(x.dot(angular), y.dot(angular), 0.0))
            }
        }
    }

    /// Converts the vector `(first, second)` in these rows to a twist. The components of the twist that the aim leaves free are 0.
    /// Both halves of each register contain the same number.
    #[inline(always)]
    pub fn twist(&self, (first, second): &Motions) -> Motions {
        match self {
            Self::Pose => (*first, *second),
            Self::Position => (pair::ZEROS, *first),
            Self::Orientation => (*first, pair::ZEROS),
            Self::Distance { along } => (pair::ZEROS, pair::twice(along) * first.x),
            Self::PositionAndAxis { across } => {
                let [x, y] = across.each_ref().map(pair::twice);
                (x * second.x + y * second.y, *first)
            }
        }
    }
}

/// Returns the direction from the origin to `point`; an arbitrary direction if `point` is the origin.
fn direction(point: &Vector3<f64>) -> Vector3<f64> {
    point.try_normalize(NO_DIRECTION).unwrap_or_else(Vector3::x)
}
