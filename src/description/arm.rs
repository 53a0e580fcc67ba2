//! A robot as its URDF describes it, and the arm that it has between two of its links.

use dq_algebra::UnitDualQuaternion;
use dq_kinematics::arm::bounds::{self, JOINT_ANGLE};
use dq_kinematics::arm::{ArmError, Chain, Joint, JointKind};
use nalgebra::{Isometry3, Unit, UnitQuaternion, Vector3};
use thiserror::Error;

/// Why a robot description gives no arm. Each names the element; text of the description is cut.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum DescriptionError {
    /// More text than any robot needs.
    #[error("{size} bytes of robot description: expected {most} at most")]
    TooLong {
        /// How many there are \[bytes\].
        size: usize,
        /// How many there may be \[bytes\].
        most: usize,
    },
    /// No XML.
    #[error("the robot description is no XML: {0}")]
    NotXml(String),
    /// XML that is no URDF.
    #[error("the robot description begins with <{0}>: expected URDF, a <robot>")]
    NotUrdf(String),
    /// A macro that has not been expanded.
    #[error(
        "<{element}> in line {line} of the robot description: expand it first, `xacro robot.urdf.xacro > robot.urdf`"
    )]
    Xacro {
        /// The macro.
        element: String,
        /// Where, counted from 1.
        line: u32,
    },
    /// A robot of nothing.
    #[error("the robot description defines no link: is it a macro file that was run through xacro?")]
    NoLink,
    /// An element without something that it must have, or with something that makes no sense.
    #[error("{kind} {name:?} of the robot description: {why}")]
    Element {
        /// What it is.
        kind: &'static str,
        /// Its name.
        name: String,
        /// What is wrong.
        why: String,
    },
    /// Links that are no one's child, of which a robot has one.
    #[error(
        "the robot description has the roots {0:?} and {1:?}: expected one link that is no joint's child"
    )]
    TwoRoots(String, String),
    /// No link of that name.
    #[error("{frame} is {name:?}, no link of the robot description, which has {known}")]
    NoSuchLink {
        /// The parameter that names it.
        frame: &'static str,
        /// The name.
        name: String,
        /// Some that there are.
        known: String,
    },
    /// Links of which none carries the other.
    #[error(
        "no joints lead from base_frame {base:?} to tool_frame {tool:?}: {tool:?} hangs from {root:?} without it"
    )]
    NotConnected {
        /// Where the arm should begin.
        base: String,
        /// Where it should end.
        tool: String,
        /// Where the tool's own chain begins.
        root: String,
    },
    /// Links that do not move against each other.
    #[error("no joint that moves is between base_frame {base:?} and tool_frame {tool:?}")]
    NoJoint {
        /// Where the arm should begin.
        base: String,
        /// Where it should end.
        tool: String,
    },
    /// The joints make no chain.
    #[error("the robot description between base_frame and tool_frame: {0}")]
    Arm(#[from] ArmError),
}

/// How a joint of a description moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// Not at all.
    Fixed,
    /// It turns between limits.
    Revolute,
    /// It turns without end.
    Continuous,
    /// It slides between limits.
    Prismatic,
}

impl Motion {
    /// What it does in a chain; none where it does not move.
    pub fn kind(self) -> Option<JointKind> {
        match self {
            Self::Fixed => None,
            Self::Revolute | Self::Continuous => Some(JointKind::Revolute),
            Self::Prismatic => Some(JointKind::Prismatic),
        }
    }
}

/// A joint's limits; rad, rad/s, rad/s², for a prismatic joint m, m/s, m/s².
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct JointLimits {
    /// Smallest position; none for a continuous joint.
    pub lower: Option<f64>,
    /// Largest position; none for a continuous joint.
    pub upper: Option<f64>,
    /// Largest speed; none for a continuous joint that has no limits.
    pub velocity: Option<f64>,
    /// Largest acceleration, where URDF 1.2 gives it.
    pub acceleration: Option<f64>,
    /// Largest deceleration, where URDF 1.2 gives it.
    pub deceleration: Option<f64>,
    /// Largest jerk \[rad/s³, m/s³\], where URDF 1.2 gives it.
    pub jerk: Option<f64>,
}

impl JointLimits {
    /// The positions between which it moves, where these leave it any room. Farther than [`JOINT_ANGLE`] it goes nowhere: more is no limit.
    pub fn range(&self) -> Option<(f64, f64)> {
        let bound = |limit: f64| limit.clamp(-JOINT_ANGLE, JOINT_ANGLE);
        self.lower.map(bound).zip(self.upper.map(bound)).filter(|(lower, upper)| lower < upper)
    }

    /// Where the joint is at the start, if nobody says where: at 0, or in the middle of its range where 0 is not inside.
    pub fn start(&self) -> f64 {
        match self.range() {
            Some((lower, upper)) if lower >= 0.0 || upper <= 0.0 => 0.5 * (lower + upper),
            _ => 0.0,
        }
    }
}

/// A joint of a description.
#[derive(Clone, Debug, PartialEq)]
pub struct DescribedJoint {
    /// Its name.
    pub name: String,
    /// How it moves.
    pub motion: Motion,
    /// The link that carries it.
    pub parent: String,
    /// The link that it carries.
    pub child: String,
    /// Its frame at position 0 in the parent's: x, y, z \[m\].
    pub xyz: [f64; 3],
    /// And roll, pitch, yaw \[rad\]: `Rz(yaw) Ry(pitch) Rx(roll)`.
    pub rpy: [f64; 3],
    /// Its axis, in its own frame, of any length above 0.
    pub axis: [f64; 3],
    /// Its limits.
    pub limits: JointLimits,
}

/// The pose that URDF gives by a position \[m\] and angles of roll, pitch and yaw about fixed axes \[rad\].
pub(crate) fn pose([x, y, z]: [f64; 3], [roll, pitch, yaw]: [f64; 3]) -> UnitDualQuaternion {
    UnitDualQuaternion::from_parts(UnitQuaternion::from_euler_angles(roll, pitch, yaw), Vector3::new(x, y, z))
}

/// The angles of roll, pitch and yaw of a rotation \[rad\], exact also where the pitch is a right angle: roll is found with yaw given, after
/// Herter and Lott, *Algorithms for decomposing 3-D orthogonal matrices into primitive rotations* (1993).
pub(crate) fn angles(rotation: &UnitQuaternion<f64>) -> [f64; 3] {
    let r = rotation.to_rotation_matrix();
    let yaw = r[(1, 0)].atan2(r[(0, 0)]);
    let (sin, cos) = yaw.sin_cos();
    let pitch = (-r[(2, 0)]).atan2(cos * r[(0, 0)] + sin * r[(1, 0)]);
    let roll = (sin * r[(0, 2)] - cos * r[(1, 2)]).atan2(cos * r[(1, 1)] - sin * r[(0, 1)]);
    [roll, pitch, yaw]
}

impl DescribedJoint {
    /// Its frame at position 0 in the parent's.
    pub fn parent_from_joint(&self) -> UnitDualQuaternion {
        pose(self.xyz, self.rpy)
    }

    /// The child's frame in the parent's with the joint at `position` \[rad, prismatic: m\].
    pub fn parent_from_child(&self, position: f64) -> UnitDualQuaternion {
        let axis = self.unit_axis();
        let moved = match self.motion.kind() {
            None => Isometry3::identity(),
            Some(JointKind::Revolute) => Isometry3::from_parts(
                Vector3::zeros().into(),
                UnitQuaternion::from_axis_angle(&axis, position),
            ),
            Some(JointKind::Prismatic) => {
                Isometry3::translation(position * axis.x, position * axis.y, position * axis.z)
            }
        };
        let frame = self.parent_from_joint().frame() * moved;
        frame.into()
    }

    fn unit_axis(&self) -> Unit<Vector3<f64>> {
        Unit::new_normalize(Vector3::from(self.axis))
    }
}

/// The arm that a description has between two links.
#[derive(Clone, Debug, PartialEq)]
pub struct DescribedArm {
    /// The robot's name.
    pub robot: String,
    /// All joints from the base to the tool, fixed ones too.
    pub joints: Vec<DescribedJoint>,
}

impl DescribedArm {
    /// The joints that move, base first.
    pub fn moving(&self) -> impl Iterator<Item = &DescribedJoint> {
        self.joints.iter().filter(|joint| joint.motion.kind().is_some())
    }

    /// The same with these limits of the joints that move, base first; what turns between two positions is no longer continuous. Where
    /// there is no speed among them there are none: URDF has no limits without one.
    #[must_use]
    pub fn with_limits(mut self, limits: impl IntoIterator<Item = JointLimits>) -> Self {
        let moving = self.joints.iter_mut().filter(|joint| joint.motion.kind().is_some());
        let limits =
            limits.into_iter().map(|limits| limits.velocity.map_or_else(JointLimits::default, |_| limits));
        for (joint, limits) in moving.zip(limits) {
            if joint.motion == Motion::Continuous && limits.lower.is_some() && limits.upper.is_some() {
                joint.motion = Motion::Revolute;
            }
            joint.limits = limits;
        }
        self
    }

    /// Its kinematics.
    ///
    /// # Errors
    /// [`DescriptionError::Arm`] where no joint moves, or lengths are beyond [`LENGTH`](dq_kinematics::arm::bounds::LENGTH).
    pub fn chain(&self) -> Result<Chain, DescriptionError> {
        let (mut joints, mut before) = (Vec::new(), Isometry3::identity());
        for joint in &self.joints {
            before *= joint.parent_from_joint().frame();
            let Some(kind) = joint.motion.kind() else { continue };
            if let Some((lower, upper)) = joint.limits.range().filter(|_| kind == JointKind::Prismatic) {
                bounds::length("travel", joints.len() + 1, upper.max(-lower))?;
            }
            joints.push(Joint { kind, parent_from_joint: before.into(), axis: joint.unit_axis() });
            before = Isometry3::identity();
        }
        let tool = before.into();
        Ok(Chain::from_joints(&joints, &tool)?)
    }
}
