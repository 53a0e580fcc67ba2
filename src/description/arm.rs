//! A robot as described by its URDF, and the arm between two of its links.

use dq_algebra::UnitDualQuaternion;
use dq_kinematics::arm::bounds::JOINT_ANGLE;
use dq_kinematics::arm::{ArmError, Chain, Coupling, Joint, JointKind};
use nalgebra::{Isometry3, Unit, UnitQuaternion, Vector3};
use thiserror::Error;

/// Why a robot description has no arm. Each error names the element; text of the description is shortened.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum DescriptionError {
    /// The text is longer than any robot needs.
    #[error("{size} bytes of robot description: expected {most} at most")]
    TooLong {
        /// The size \[bytes\].
        size: usize,
        /// The largest allowed size \[bytes\].
        most: usize,
    },
    /// The text is not XML.
    #[error("the robot description is no XML: {0}")]
    NotXml(String),
    /// The XML is not URDF.
    #[error("the robot description begins with <{0}>: expected URDF, a <robot>")]
    NotUrdf(String),
    /// A macro has not been expanded.
    #[error(
        "<{element}> in line {line} of the robot description: expand it first, `xacro robot.urdf.xacro > robot.urdf`"
    )]
    Xacro {
        /// The macro.
        element: String,
        /// Its line, counted from 1.
        line: u32,
    },
    /// The robot has no links.
    #[error("the robot description defines no link: is it a macro file that was run through xacro?")]
    NoLink,
    /// An element lacks a required part, or has an invalid one.
    #[error("{kind} {name:?} of the robot description: {why}")]
    Element {
        /// The kind of element.
        kind: &'static str,
        /// Its name.
        name: String,
        /// The fault.
        why: String,
    },
    /// Two links are not the child of any joint, although a robot has one such link.
    #[error(
        "the robot description has the roots {0:?} and {1:?}: expected one link that is no joint's child"
    )]
    TwoRoots(String, String),
    /// The name is not that of a link.
    #[error("{frame} is {name:?}, no link of the robot description, which has {known}")]
    NoSuchLink {
        /// The parameter that names the link.
        frame: &'static str,
        /// The name.
        name: String,
        /// Some of the existing links.
        known: String,
    },
    /// No chain leads from the base to the tool.
    #[error(
        "no joints lead from base_frame {base:?} to tool_frame {tool:?}: {tool:?} hangs from {root:?} without it"
    )]
    NotConnected {
        /// The base frame.
        base: String,
        /// The tool frame.
        tool: String,
        /// The root of the tool's own chain.
        root: String,
    },
    /// Several chains have equal claims to be the arm.
    #[error("the robot description has several arms: give tool_frame, for example {}", .0.join(" or "))]
    SeveralArms(Vec<String>),
    /// The links do not move relative to each other.
    #[error("no joint that moves is between base_frame {base:?} and tool_frame {tool:?}")]
    NoJoint {
        /// The base frame.
        base: String,
        /// The tool frame.
        tool: String,
    },
    /// The joints are not a valid chain.
    #[error("the robot description between base_frame and tool_frame: {0}")]
    Arm(#[from] ArmError),
}

/// How a joint of a description moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// It does not move.
    Fixed,
    /// It turns between limits.
    Revolute,
    /// It turns without limits.
    Continuous,
    /// It slides between limits.
    Prismatic,
}

impl Motion {
    /// Returns its kind in a chain; `None` if it does not move.
    pub fn kind(self) -> Option<JointKind> {
        match self {
            Self::Fixed => None,
            Self::Revolute | Self::Continuous => Some(JointKind::Revolute),
            Self::Prismatic => Some(JointKind::Prismatic),
        }
    }
}

/// The limits of a joint, in rad, rad/s, rad/s²; for a prismatic joint in m, m/s, m/s².
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct JointLimits {
    /// The smallest position; `None` for a continuous joint.
    pub lower: Option<f64>,
    /// The largest position; `None` for a continuous joint.
    pub upper: Option<f64>,
    /// The largest speed; `None` for a continuous joint without limits.
    pub velocity: Option<f64>,
    /// The largest acceleration, if given (URDF 1.2).
    pub acceleration: Option<f64>,
    /// The largest deceleration, if given (URDF 1.2).
    pub deceleration: Option<f64>,
    /// The largest jerk \[rad/s³, m/s³\], if given (URDF 1.2).
    pub jerk: Option<f64>,
}

impl JointLimits {
    /// Returns its position limits, if they form a range. They are bounded by [`JOINT_ANGLE`], because more does not restrict the joint.
    pub fn range(&self) -> Option<(f64, f64)> {
        let bound = |limit: f64| limit.clamp(-JOINT_ANGLE, JOINT_ANGLE);
        self.lower.map(bound).zip(self.upper.map(bound)).filter(|(lower, upper)| lower < upper)
    }

    /// Returns the default start position: 0, or the middle of the range if 0 is not inside.
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
    /// The parent link.
    pub parent: String,
    /// The child link.
    pub child: String,
    /// The position of its frame in the parent's, at joint position 0: x, y, z \[m\].
    pub xyz: [f64; 3],
    /// The orientation of its frame: roll, pitch, yaw \[rad\], `Rz(yaw) Ry(pitch) Rx(roll)`.
    pub rpy: [f64; 3],
    /// Its axis, in its own frame, of any length above 0.
    pub axis: [f64; 3],
    /// Its limits.
    pub limits: JointLimits,
    /// The joint that it mimics, if any.
    pub mimic: Option<Mimic>,
}

/// How a joint follows another one: its position is `multiplier · position + offset`.
#[derive(Clone, Debug, PartialEq)]
pub struct Mimic {
    /// The joint that drives it, which mimics no other.
    pub driver: String,
    /// Its speed per speed of the driver.
    pub multiplier: f64,
    /// Its position with the driver at 0 \[rad, prismatic: m\].
    pub offset: f64,
}

/// Returns the pose with this position \[m\] and these angles of roll, pitch and yaw about fixed axes \[rad\].
pub(crate) fn pose([x, y, z]: [f64; 3], [roll, pitch, yaw]: [f64; 3]) -> UnitDualQuaternion {
    UnitDualQuaternion::from_parts(UnitQuaternion::from_euler_angles(roll, pitch, yaw), Vector3::new(x, y, z))
}

/// Returns the roll, pitch and yaw of a rotation \[rad\]. They are exact even for a pitch of 90°, because roll is computed from yaw, after
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
    /// Returns its frame at position 0, relative to the parent's.
    pub fn parent_from_joint(&self) -> UnitDualQuaternion {
        pose(self.xyz, self.rpy)
    }

    /// Returns the child's frame relative to the parent's, with the joint at `position` \[rad, prismatic: m\].
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

    /// Narrows its limits so that `joint`, which mimics it, keeps within its own.
    pub(crate) fn bind(&mut self, joint: &Self, Mimic { multiplier, offset, .. }: &Mimic) {
        let limits = &mut self.limits;
        if let Some((lower, upper)) = joint.limits.range() {
            let (one, other) = ((lower - offset) / multiplier, (upper - offset) / multiplier);
            let (least, most) = (one.min(other), one.max(other));
            limits.lower = Some(limits.lower.map_or(least, |lower| lower.max(least)));
            limits.upper = Some(limits.upper.map_or(most, |upper| upper.min(most)));
            if self.motion == Motion::Continuous {
                self.motion = Motion::Revolute;
            }
        }
        // Many descriptions have no speed, or 0, for joints without a motor.
        if let Some(speed) = joint.limits.velocity.filter(|speed| *speed > 0.0) {
            limits.velocity = limits.velocity.map(|own| own.min(speed / multiplier.abs()));
        }
    }

    fn unit_axis(&self) -> Unit<Vector3<f64>> {
        Unit::new_normalize(Vector3::from(self.axis))
    }
}

/// The arm in a description between two links.
#[derive(Clone, Debug, PartialEq)]
pub struct DescribedArm {
    /// The robot's name.
    pub robot: String,
    /// All joints from the base to the tool, including fixed ones.
    pub joints: Vec<DescribedJoint>,
    /// Joints elsewhere that some of these mimic, as if they were at the base.
    pub drivers: Vec<DescribedJoint>,
}

impl DescribedArm {
    /// Yields the joints that move on their own, base first: those from the base to the tool that mimic no other, and before the first that
    /// mimics one elsewhere, that one. Their limits keep the joints that mimic them within their own.
    pub fn moving(&self) -> impl Iterator<Item = &DescribedJoint> {
        let mut elsewhere: Vec<_> = self.drivers.iter().collect();
        self.links().filter_map(move |joint| match &joint.mimic {
            None => Some(joint),
            Some(Mimic { driver, .. }) => {
                let at = elsewhere.iter().position(|joint| joint.name == *driver)?;
                Some(elsewhere.remove(at))
            }
        })
    }

    /// Yields the joints from the base to the tool that move, base first: one for each link of the [`chain`](Self::chain).
    pub fn links(&self) -> impl Iterator<Item = &DescribedJoint> {
        self.joints.iter().filter(|joint| joint.motion.kind().is_some())
    }

    /// Returns how the joints of the arm drive `joint`; `None` if they do not.
    pub fn coupling(&self, joint: &DescribedJoint) -> Option<Coupling> {
        let (name, ratio, offset) = match &joint.mimic {
            None => (&joint.name, 1.0, 0.0),
            Some(Mimic { driver, multiplier, offset }) => (driver, *multiplier, *offset),
        };
        let driver = self.moving().position(|driver| driver.name == *name)?;
        Some(Coupling { driver, ratio, offset })
    }

    /// Sets the limits of the joints that move, base first; a continuous joint with position limits becomes revolute. Limits without a
    /// speed are ignored, because URDF requires a speed.
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

    /// Returns its kinematics.
    ///
    /// # Errors
    /// [`DescriptionError::Arm`] if no joint moves, or if lengths exceed [`LENGTH`](dq_kinematics::arm::bounds::LENGTH).
    pub fn chain(&self) -> Result<Chain, DescriptionError> {
        let (mut joints, mut before) = (Vec::new(), Isometry3::identity());
        for joint in &self.joints {
            before *= joint.parent_from_joint().frame();
            let Some(kind) = joint.motion.kind() else { continue };
            joints.push(Joint { kind, parent_from_joint: before.into(), axis: joint.unit_axis() });
            before = Isometry3::identity();
        }
        let chain = Chain::from_joints(&joints, &before.into())?;
        let kinds = self.moving().filter_map(|joint| joint.motion.kind()).collect();
        let couplings = self.links().filter_map(|joint| self.coupling(joint)).collect();
        Ok(chain.driven_by(kinds, couplings)?)
    }
}
