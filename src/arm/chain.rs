//! A serial chain of revolute and prismatic joints and its forward kinematics.

use super::half_turns::{LANES, half_turns};
use super::{ArmError, ArmState, Convention, DhRow, bounds};
use crate::dq::UnitDualQuaternion;
use nalgebra::{Isometry3, Quaternion, Unit, UnitQuaternion, Vector3};

/// What a joint does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JointKind {
    /// It turns about its axis: its position is an angle \[rad\].
    Revolute,
    /// It slides along its axis: its position is a length \[m\].
    Prismatic,
}

impl JointKind {
    /// The unit of its position.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Revolute => "rad",
            Self::Prismatic => "m",
        }
    }
}

/// A joint of a chain, as a robot description gives it.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// What it does.
    pub kind: JointKind,
    /// Its frame at position 0 in that of the joint before it, or in the base frame.
    pub parent_from_joint: UnitDualQuaternion,
    /// Its axis, in its own frame.
    pub axis: Unit<Vector3<f64>>,
    /// How far it can slide from position 0 \[m\]; of no use for one that turns.
    pub farthest: f64,
}

/// A serial arm with any number of revolute and prismatic joints.
///
/// DH rows of both conventions and joints about any axes become one form: before each rotation about z, or shift along it, there is a
/// fixed transform, and after the last a fixed transform to the tool.
#[derive(Clone, Debug, PartialEq)]
pub struct Chain {
    /// Link i−1 (or the base) from the frame in which joint i turns about z or slides along it, at position 0.
    before_joint: Vec<Isometry3<f64>>,
    kinds: Vec<JointKind>,
    last_link_from_tool: Isometry3<f64>,
    /// Where the arm stands.
    base_point: Vector3<f64>,
    reach: f64,
}

impl Chain {
    /// From DH rows, base first.
    ///
    /// # Errors
    /// [`ArmError::NoJoints`], [`ArmError::NonFinite`], [`ArmError::OutOfRange`].
    pub fn new(convention: Convention, rows: &[DhRow]) -> Result<Self, ArmError> {
        if rows.is_empty() {
            return Err(ArmError::NoJoints);
        }
        rows.iter().enumerate().try_for_each(|(i, row)| row.check(i + 1))?;
        let fixed = rows.iter().map(|row| row.fixed(convention).frame());
        let (mut before, last_link_from_tool): (Vec<_>, _) = match convention {
            Convention::ModifiedDh => (fixed.collect(), Isometry3::identity()),
            Convention::StandardDh => {
                let mut shifted: Vec<_> = std::iter::once(Isometry3::identity()).chain(fixed).collect();
                let last = shifted.pop().unwrap_or_else(Isometry3::identity);
                (shifted, last)
            }
        };
        for (transform, row) in before.iter_mut().zip(rows) {
            let (sin, cos) = (0.5 * row.theta_offset).sin_cos();
            *transform = turned(transform, cos, sin);
        }
        let reach = rows.iter().map(DhRow::length).sum();
        let kinds = vec![JointKind::Revolute; rows.len()];
        Ok(Self { before_joint: before, kinds, last_link_from_tool, base_point: Vector3::zeros(), reach })
    }

    /// From joints, base first, and the tool in the last joint's frame.
    ///
    /// # Errors
    /// [`ArmError::NoJoints`], [`ArmError::NonFinite`], [`ArmError::OutOfRange`].
    pub fn from_joints(joints: &[Joint], last_joint_from_tool: &UnitDualQuaternion) -> Result<Self, ArmError> {
        if joints.is_empty() {
            return Err(ArmError::NoJoints);
        }
        let (mut before_joint, mut reach) = (Vec::with_capacity(joints.len()), 0.0);
        // From the frame whose z is the last joint's axis to the joint's own.
        let mut z_from_joint = Isometry3::identity();
        for (i, joint) in joints.iter().enumerate() {
            let shift = joint.parent_from_joint.translation();
            let slide = if joint.kind == JointKind::Prismatic { joint.farthest } else { 0.0 };
            reach += bounds::length("origin", i + 1, shift.norm())? + bounds::length("travel", i + 1, slide)?;
            let joint_from_z = Isometry3::from_parts(Vector3::zeros().into(), from_z(&joint.axis));
            before_joint.push(z_from_joint * joint.parent_from_joint.frame() * joint_from_z);
            z_from_joint = joint_from_z.inverse();
        }
        reach += bounds::length("tool", joints.len(), last_joint_from_tool.translation().norm())?;
        Ok(Self {
            before_joint,
            kinds: joints.iter().map(|joint| joint.kind).collect(),
            last_link_from_tool: z_from_joint * last_joint_from_tool.frame(),
            base_point: Vector3::zeros(),
            reach,
        })
    }

    /// What each joint does, base first.
    pub fn kinds(&self) -> &[JointKind] {
        &self.kinds
    }

    /// The number of joints.
    pub fn joint_count(&self) -> usize {
        self.before_joint.len()
    }

    /// The same arm standing at `world_from_base`: from then on its base frame is the world.
    pub fn standing_at(mut self, world_from_base: &UnitDualQuaternion) -> Self {
        if let Some(first) = self.before_joint.first_mut() {
            *first = world_from_base.frame() * *first;
        }
        self.base_point = world_from_base.rotation() * self.base_point + world_from_base.translation();
        self
    }

    /// Where the arm stands \[m\].
    pub fn base_point(&self) -> Vector3<f64> {
        self.base_point
    }

    /// An upper bound of the distance from where the arm stands to its tool \[m\].
    pub fn reach(&self) -> f64 {
        self.reach
    }

    /// `base_from_tool` at joint positions `theta` \[rad, prismatic: m\] (eq. 14), with the sign that the product of the factors has.
    ///
    /// # Errors
    /// [`ArmError::JointCount`].
    pub fn forward_kinematics(&self, theta: &[f64]) -> Result<UnitDualQuaternion, ArmError> {
        self.check_count(theta)?;
        let mut base_from_link = Isometry3::identity();
        self.for_each_link(theta, |frame| base_from_link = frame);
        Ok(pose(&(base_from_link * self.last_link_from_tool)))
    }

    /// `base_from_link` of each link: the frame that moves with joint i, z along its axis.
    ///
    /// # Errors
    /// [`ArmError::JointCount`].
    pub fn link_poses(&self, theta: &[f64]) -> Result<Vec<UnitDualQuaternion>, ArmError> {
        self.check_count(theta)?;
        let mut poses = Vec::with_capacity(self.joint_count());
        self.for_each_link(theta, |frame| poses.push(pose(&frame)));
        Ok(poses)
    }

    /// Fills `state` with the tool pose and the joint axes at `theta` \[rad, prismatic: m\], without allocating.
    ///
    /// # Errors
    /// [`ArmError::JointCount`] where `theta` or `state` do not fit this arm.
    pub fn evaluate(&self, theta: &[f64], state: &mut ArmState) -> Result<(), ArmError> {
        self.check_count(theta)?;
        let mut axes = state.axes_mut(self.joint_count())?.iter_mut();
        let mut base_from_link = Isometry3::identity();
        self.for_each_link(theta, |frame| {
            if let Some(axis) = axes.next() {
                (axis.direction, axis.point) = (z_axis(&frame.rotation), frame.translation.vector);
            }
            base_from_link = frame;
        });
        let base_from_tool = base_from_link * self.last_link_from_tool;
        state.set_tool(pose(&base_from_tool), base_from_tool.translation.vector);
        Ok(())
    }

    /// Calls `each` with `base_from_link` of each link, base first.
    ///
    /// Fast because a link is a quaternion and a point, not a dual quaternion: a quarter less to multiply, and the point is what the
    /// Jacobian needs. The signs are those of the product of dual quaternions. The half angles' sines are computed several at once.
    fn for_each_link(&self, theta: &[f64], mut each: impl FnMut(Isometry3<f64>)) {
        let mut base_from_link = Isometry3::identity();
        let links = self.before_joint.chunks(LANES).zip(self.kinds.chunks(LANES));
        for ((joints, kinds), positions) in links.zip(theta.chunks(LANES)) {
            let mut lanes = [0.0; LANES];
            lanes.iter_mut().zip(positions).for_each(|(lane, angle)| *lane = *angle);
            let (cosines, sines) = half_turns(&lanes);
            for (i, (before, kind)) in joints.iter().zip(kinds).enumerate() {
                base_from_link *= match kind {
                    JointKind::Revolute => turned(before, cosines[i], sines[i]),
                    JointKind::Prismatic => slid(before, positions[i]),
                };
                each(base_from_link);
            }
        }
    }

    /// The tool in the last link.
    pub fn last_link_from_tool(&self) -> UnitDualQuaternion {
        pose(&self.last_link_from_tool)
    }

    /// Each joint's frame at θ = 0 in the link before it (or the base), base first.
    pub(super) fn parent_from_joint(&self) -> Vec<UnitDualQuaternion> {
        self.before_joint.iter().map(pose).collect()
    }

    fn check_count(&self, theta: &[f64]) -> Result<(), ArmError> {
        match theta.len() == self.joint_count() {
            true => Ok(()),
            false => Err(ArmError::JointCount { expected: self.joint_count(), got: theta.len() }),
        }
    }
}

/// The frame turned about its own z axis by the angle whose half has this cosine and sine.
fn turned(frame: &Isometry3<f64>, cos: f64, sin: f64) -> Isometry3<f64> {
    let q = frame.rotation.quaternion();
    let rotation = Quaternion::new(
        q.w * cos - q.k * sin,
        q.i * cos + q.j * sin,
        q.j * cos - q.i * sin,
        q.k * cos + q.w * sin,
    );
    Isometry3::from_parts(frame.translation, UnitQuaternion::new_unchecked(rotation))
}

/// The frame shifted along its own z axis by this distance \[m\].
fn slid(frame: &Isometry3<f64>, distance: f64) -> Isometry3<f64> {
    let shift = frame.translation.vector + distance * z_axis(&frame.rotation);
    Isometry3::from_parts(shift.into(), frame.rotation)
}

/// A rotation that takes z to this direction, exact to rounding everywhere, which one by way of the arc cosine of their product is
/// not near the poles: the shortest one, or from −z on, after half a turn about x.
fn from_z(direction: &Unit<Vector3<f64>>) -> UnitQuaternion<f64> {
    let (x, y, z) = (direction.x, direction.y, direction.z);
    UnitQuaternion::new_normalize(match z >= 0.0 {
        true => Quaternion::new(1.0 + z, -y, x, 0.0),
        false => Quaternion::new(-y, 1.0 - z, 0.0, x),
    })
}

/// Where z goes.
fn z_axis(rotation: &UnitQuaternion<f64>) -> Vector3<f64> {
    let q = rotation.quaternion();
    let (x, y) = (q.i * q.k + q.w * q.j, q.j * q.k - q.w * q.i);
    Vector3::new(2.0 * x, 2.0 * y, 1.0 - 2.0 * (q.i * q.i + q.j * q.j))
}

/// The frame as a dual quaternion of the same sign, with the rounding of the products taken out.
fn pose(frame: &Isometry3<f64>) -> UnitDualQuaternion {
    let rotation = frame.rotation.quaternion();
    let scale = 0.5 * (3.0 - rotation.norm_squared());
    UnitDualQuaternion::from_parts(UnitQuaternion::new_unchecked(rotation * scale), frame.translation.vector)
}
