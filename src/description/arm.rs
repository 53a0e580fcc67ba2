//! A robot as its URDF describes it, and the arm between two of its links.

use dq_algebra::UnitDualQuaternion;
use dq_kinematics::arm::bounds::JOINT_ANGLE;
use dq_kinematics::arm::{ArmError, Chain, Coupling, Joint, JointKind};
use nalgebra::{Isometry3, Unit, UnitQuaternion, Vector3};
use thiserror::Error;

/// The reason why a robot description has no arm. Each error names the faulty element, and shortens text that comes from the
/// description.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum DescriptionError {
    /// The text is longer than any robot needs.
    #[error("{size} bytes of robot description: expected {most} at most")]
    TooLong {
        /// The size of the text \[bytes\].
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
    /// The description has a macro that is not expanded.
    #[error(
        "<{element}> in line {line} of the robot description: expand it first, `xacro robot.urdf.xacro > robot.urdf`"
    )]
    Xacro {
        /// The name of the macro.
        element: String,
        /// The line of the macro, counted from 1.
        line: u32,
    },
    /// The robot has no links.
    #[error("the robot description defines no link: is it a macro file that was run through xacro?")]
    NoLink,
    /// An element lacks a required part, or has an invalid part.
    #[error("{kind} {name:?} of the robot description: {why}")]
    Element {
        /// The kind of element.
        kind: &'static str,
        /// The name of the element.
        name: String,
        /// What is missing or invalid.
        why: String,
    },
    /// Two links are not the child of any joint. A robot has exactly one such link.
    #[error(
        "the robot description has the roots {0:?} and {1:?}: expected one link that is no joint's child"
    )]
    TwoRoots(String, String),
    /// There is no link with this name.
    #[error("{frame} is {name:?}, no link of the robot description, which has {known}")]
    NoSuchLink {
        /// The parameter that names the link.
        frame: &'static str,
        /// The parameter's value, which names no link.
        name: String,
        /// Some link names of the robot description, for the error message.
        known: String,
    },
    /// No chain of joints leads from the base to the tool.
    #[error(
        "no joints lead from base_frame {base:?} to tool_frame {tool:?}: {tool:?} hangs from {root:?} without it"
    )]
    NotConnected {
        /// The name of the base frame.
        base: String,
        /// The name of the tool frame.
        tool: String,
        /// The link at which the tool's chain begins.
        root: String,
    },
    /// Several chains could equally well be the arm.
    #[error("the robot description has several arms: give tool_frame, for example {}", .0.join(" or "))]
    SeveralArms(Vec<String>),
    /// No joint between the base frame and the tool frame moves.
    #[error("no joint that moves is between base_frame {base:?} and tool_frame {tool:?}")]
    NoJoint {
        /// The name of the base frame.
        base: String,
        /// The name of the tool frame.
        tool: String,
    },
    /// The joints are not a valid chain.
    #[error("the robot description between base_frame and tool_frame: {0}")]
    Arm(#[from] ArmError),
}

/// How a joint of a description moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// The joint does not move.
    Fixed,
    /// The joint turns within limits.
    Revolute,
    /// The joint turns without limits.
    Continuous,
    /// The joint slides within limits.
    Prismatic,
}

impl Motion {
    /// Returns the kind of the joint in a chain; `None` if the joint does not move.
    pub fn kind(self) -> Option<JointKind> {
        match self {
            Self::Fixed => None,
            Self::Revolute | Self::Continuous => Some(JointKind::Revolute),
            Self::Prismatic => Some(JointKind::Prismatic),
        }
    }
}

/// The limits of a joint.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct JointLimits {
    /// The smallest position \[rad, prismatic: m\]; `None` for a continuous joint.
    pub lower: Option<f64>,
    /// The largest position \[rad, prismatic: m\]; `None` for a continuous joint.
    pub upper: Option<f64>,
    /// The largest speed [rad/s, prismatic: m/s]; `None` if the description has none.
    pub velocity: Option<f64>,
    /// The largest acceleration [rad/s², prismatic: m/s²]; `None` if the description has none. Only URDF 1.2 has accelerations.
    pub acceleration: Option<f64>,
    /// The largest deceleration [rad/s², prismatic: m/s²]; `None` if the description has none. Only URDF 1.2 has decelerations.
    pub deceleration: Option<f64>,
    /// The largest jerk [rad/s³, prismatic: m/s³]; `None` if the description has none. Only URDF 1.2 has jerks.
    pub jerk: Option<f64>,
}

impl JointLimits {
    /// Returns the position limits; `None` if they do not form a range. Limits larger than [`JOINT_ANGLE`] are reduced to that
    /// size, because such limits do not restrict the joint.
    pub fn range(&self) -> Option<(f64, f64)> {
        let bound = |limit: f64| limit.clamp(-JOINT_ANGLE, JOINT_ANGLE);
        self.lower.map(bound).zip(self.upper.map(bound)).filter(|(lower, upper)| lower < upper)
    }

    /// Returns the default start position: 0, or the middle of the range if 0 is outside the range.
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
    /// The name of the joint.
    pub name: String,
    /// How the joint moves.
    pub motion: Motion,
    /// The name of the parent link.
    pub parent: String,
    /// The name of the child link.
    pub child: String,
    /// The position of the joint's frame in the parent's frame, at joint position 0: x, y, z \[m\].
    pub xyz: [f64; 3],
    /// The orientation of the joint's frame: roll, pitch, yaw \[rad\], `Rz(yaw) Ry(pitch) Rx(roll)`.
    pub rpy: [f64; 3],
    /// The joint's axis in its own frame. Its length is above 0 and does not matter.
    pub axis: [f64; 3],
    /// The limits of the joint.
    pub limits: JointLimits,
    /// The joint that this joint mimics, if any.
    pub mimic: Option<Mimic>,
}

/// How a joint follows its driver. If the driver is at position p, the joint is at `multiplier · p + offset`.
#[derive(Clone, Debug, PartialEq)]
pub struct Mimic {
    /// The name of the driver, which mimics no other joint.
    pub driver: String,
    /// The joint's speed divided by the driver's speed.
    pub multiplier: f64,
    /// The joint's position when the driver is at 0 \[rad, prismatic: m\].
    pub offset: f64,
}

/// Returns the pose with this position \[m\] and these angles of roll, pitch and yaw about fixed axes \[rad\].
pub(crate) fn pose([x, y, z]: [f64; 3], [roll, pitch, yaw]: [f64; 3]) -> UnitDualQuaternion {
    UnitDualQuaternion::from_parts(UnitQuaternion::from_euler_angles(roll, pitch, yaw), Vector3::new(x, y, z))
}

/// Returns the roll, pitch and yaw of a rotation \[rad\]. The angles are accurate even for a pitch of 90°, because roll is computed
/// from yaw, after Herter and Lott, *Algorithms for decomposing 3-D orthogonal matrices into primitive rotations* (1993).
pub(crate) fn angles(rotation: &UnitQuaternion<f64>) -> [f64; 3] {
    let r = rotation.to_rotation_matrix();
    let yaw = r[(1, 0)].atan2(r[(0, 0)]);
    let (sin, cos) = yaw.sin_cos();
    let pitch = (-r[(2, 0)]).atan2(cos * r[(0, 0)] + sin * r[(1, 0)]);
    let roll = (sin * r[(0, 2)] - cos * r[(1, 2)]).atan2(cos * r[(1, 1)] - sin * r[(0, 1)]);
    [roll, pitch, yaw]
}

impl DescribedJoint {
    /// Returns the joint's frame in the parent's frame, at joint position 0.
    pub fn parent_from_joint(&self) -> UnitDualQuaternion {
        pose(self.xyz, self.rpy)
    }

    /// Returns the child's frame in the parent's frame, with the joint at `position` \[rad, prismatic: m\].
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

    /// Narrows the limits of this joint so that `joint`, which mimics this joint, stays within its own limits.
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
        // Many descriptions have no speed, or a speed of 0, for joints without a motor.
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
    /// The name of the robot.
    pub robot: String,
    /// All joints from the base to the tool, including fixed joints.
    pub joints: Vec<DescribedJoint>,
    /// The joints that are not between base and tool, but drive mimic joints between base and tool. The frames of these joints do
    /// not matter.
    pub drivers: Vec<DescribedJoint>,
}

impl DescribedArm {
    /// Yields the joints that move independently, base first. These are the joints between base and tool that mimic no other joint.
    /// If a joint mimics one of the [`drivers`](Self::drivers), this driver takes the place of the first joint that mimics it. The
    /// limits of each driver keep its mimic joints within their own limits.
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

    /// Yields the joints between base and tool that are not fixed, base first: one for each link of the [`chain`](Self::chain).
    pub fn links(&self) -> impl Iterator<Item = &DescribedJoint> {
        self.joints.iter().filter(|joint| joint.motion.kind().is_some())
    }

    /// Returns how a joint of the arm drives `joint`; `None` if no joint of the arm drives it. A joint that is not a mimic joint drives
    /// itself.
    pub fn coupling(&self, joint: &DescribedJoint) -> Option<Coupling> {
        let (name, ratio, offset) = match &joint.mimic {
            None => (&joint.name, 1.0, 0.0),
            Some(Mimic { driver, multiplier, offset }) => (driver, *multiplier, *offset),
        };
        let driver = self.moving().position(|driver| driver.name == *name)?;
        Some(Coupling { driver, ratio, offset })
    }

    /// Sets the limits of the joints that are not fixed: `limits` yields one entry for each of them, base first. A continuous joint
    /// that gets position limits becomes revolute. An entry without a speed leaves its joint without any limits, because URDF
    /// requires a speed.
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

    /// Returns the kinematics of the arm.
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
