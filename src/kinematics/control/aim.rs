//! What of the tool's pose is asked for, and what is left free.

use super::angular_linear::{AngularLinear, first, twice};
use super::gram::Gram;
use crate::arm::ArmState;
use crate::arm::pair::{self, Motions};
use dq_algebra::UnitDualQuaternion;
use dq_common::named;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

named! {
    /// What of a goal's pose the tool is asked for; the rest is free, and no law disturbs it.
    "task" Aim {
        /// All of it.
        Pose = "pose",
        /// Where the tool point is; how the tool is turned is free.
        Position = "position",
        /// Where the tool point is and where the tool's z axis points; the turn about that axis is free.
        PositionAndAxis = "position_and_axis",
        /// How the tool is turned; where it is is free.
        Orientation = "orientation",
        /// How far the tool point is from the base's origin: of two arms, how far their tools are apart.
        Distance = "distance",
    }
}

/// Below this length a vector has no direction.
const NO_DIRECTION: f64 = 1e-12;

impl Aim {
    /// Every aim, in the order of its names.
    pub const ALL: [Self; 5] =
        [Self::Pose, Self::Position, Self::PositionAndAxis, Self::Orientation, Self::Distance];

    /// The names of two arms' aims, in the order of [`ALL`](Self::ALL).
    pub const RELATIVE_NAMES: &'static [&'static str] = &[
        "relative_pose",
        "relative_position",
        "relative_position_and_axis",
        "relative_orientation",
        "relative_distance",
    ];

    /// Of all poses that meet `base_from_goal` the one nearest to the tool's: with its point, turned as little as the aim takes. Of the
    /// axis alone that is the shortest arc, in the plane of both z axes; where they are opposite, about the tool's x axis.
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

    /// The tool point \[m\] of [`nearest`](Self::nearest) to a tool whose point is `tool_point` \[m\].
    #[inline(always)]
    pub fn point(self, base_from_goal: &UnitDualQuaternion, tool_point: &Vector3<f64>) -> Vector3<f64> {
        match self {
            Self::Pose | Self::Position | Self::PositionAndAxis => base_from_goal.translation(),
            Self::Orientation => *tool_point,
            Self::Distance => direction(tool_point) * base_from_goal.translation().norm(),
        }
    }

    /// The rotation that a tool with this rotation lacks, along the base's axes: from its own to that of [`nearest`](Self::nearest).
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
                    // Half the sum's length is cos(½φ), and the sum's angle to each of them ½φ.
                    Some(between) => Quaternion::from_parts(0.5 * middle.norm(), now.cross(&between)),
                    None => Quaternion::from_imag(rotation * Vector3::x()),
                }
            }
        }
    }

    /// The angle \[rad\] that the tool lacks in what is asked for, up to a whole turn for a goal with the farther sign.
    pub fn angle(self, base_from_goal: &UnitDualQuaternion, base_from_tool: &UnitDualQuaternion) -> f64 {
        let turn = self.turn(base_from_goal, &base_from_tool.rotation());
        2.0 * turn.imag().norm().atan2(turn.w)
    }

    /// What of the twist `(ω, v)` [rad/s, m/s] of the tool of `arm`, along the base's axes, is asked for.
    pub fn part_of(self, arm: &ArmState, twist: &AngularLinear) -> AngularLinear {
        let rows = self.rows(arm);
        first(&rows.twist(&twice(&rows.of(twist))))
    }

    /// The name where the pose is that of a tool as seen from another.
    pub fn relative_name(self) -> &'static str {
        Self::RELATIVE_NAMES[self as usize]
    }

    /// The aim with that [`relative_name`](Self::relative_name).
    pub fn from_relative_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|aim| aim.relative_name() == name)
    }

    /// The rows of the tool's Jacobian that are asked for, where `arm` is.
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

/// The rows of the tool's Jacobian that an aim asks for, the first ones of six: of the pose angular, then linear, along the base's axes; of
/// position and axis linear, then angular about the axes across the tool's; of the distance linear, along the way to the tool.
pub(super) enum Rows {
    Pose,
    Position,
    PositionAndAxis { across: [Vector3<f64>; 2] },
    Orientation,
    Distance { along: Vector3<f64> },
}

impl Rows {
    /// `J Jᵀ` in these rows; along the others stiff, so that none of them is the weakest.
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

    /// Of a twist `(ω, v)` of the tool along the base's axes these rows, and zeros.
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

    /// The twist with these numbers in the rows, and none in the others; each number twice.
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

/// The direction to that point, and some direction where it is the origin.
fn direction(point: &Vector3<f64>) -> Vector3<f64> {
    point.try_normalize(NO_DIRECTION).unwrap_or_else(Vector3::x)
}
