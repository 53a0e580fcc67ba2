//! A serial chain of revolute joints and its forward kinematics.

use super::half_turns::half_turns;
use super::link::{ChainEnd, Link};
use super::{ArmError, ArmState, Convention, DhRow};
use crate::dq::UnitDualQuaternion;
use nalgebra::{Isometry3, Quaternion, UnitQuaternion, Vector3};
use wide::f64x2;

/// A serial arm with any number of revolute joints.
///
/// Both DH conventions become one form: before each rotation about z there is a fixed transform, and after the last a
/// fixed transform to the tool.
#[derive(Clone, Debug, PartialEq)]
pub struct Chain {
    /// Link i−1 (or the base) from the frame in which joint i turns about z, at θ = 0.
    before_joint: Vec<Isometry3<f64>>,
    /// None where the tool is the last link.
    last_link_from_tool: Option<Isometry3<f64>>,
    /// The same links and what each joint's half angle gets from them.
    links: Vec<Link>,
    half_angles: Vec<f64>,
    /// The turn about z that is left before the first joint.
    first_turn: ChainEnd,
    /// Where the arm stands.
    base_point: Vector3<f64>,
    reach: f64,
}

/// So many joints have their half turns computed before the first of them goes into the chain.
const BLOCK: usize = 8;

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
        let chain = Self {
            before_joint: before,
            last_link_from_tool: Some(last_link_from_tool).filter(|tool| *tool != Isometry3::identity()),
            links: Vec::new(),
            half_angles: Vec::new(),
            first_turn: ChainEnd::turned(0.0),
            base_point: Vector3::zeros(),
            reach,
        };
        Ok(chain.with_links())
    }

    /// With its links as its transforms are.
    fn with_links(mut self) -> Self {
        let links = self.before_joint.iter().map(Link::new);
        let befores = links.clone().map(|(_, before, _)| before).chain([0.0]);
        self.first_turn = ChainEnd::turned(befores.clone().next().unwrap_or(0.0));
        self.half_angles =
            links.clone().zip(befores.skip(1)).map(|((_, _, after), next)| after + next).collect();
        self.links = links.map(|(link, _, _)| link).collect();
        self
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
        self.with_links()
    }

    /// Where the arm stands \[m\].
    pub fn base_point(&self) -> Vector3<f64> {
        self.base_point
    }

    /// An upper bound of the distance from where the arm stands to its tool \[m\].
    pub fn reach(&self) -> f64 {
        self.reach
    }

    /// `base_from_tool` at joint angles `theta` \[rad\] (eq. 14), with the sign that the product of the factors has.
    ///
    /// # Errors
    /// [`ArmError::JointCount`].
    pub fn forward_kinematics(&self, theta: &[f64]) -> Result<UnitDualQuaternion, ArmError> {
        self.check_count(theta)?;
        let (base_from_tool, _) =
            self.for_each_joint(theta, |_, _| ()).tool(self.last_link_from_tool.as_ref());
        Ok(base_from_tool)
    }

    /// `base_from_link` of each link: the frame that turns with joint i, z along its axis.
    ///
    /// # Errors
    /// [`ArmError::JointCount`].
    pub fn link_poses(&self, theta: &[f64]) -> Result<Vec<UnitDualQuaternion>, ArmError> {
        self.check_count(theta)?;
        let links =
            self.before_joint.iter().zip(theta).scan(Isometry3::identity(), |frame, (before, angle)| {
                let (sin, cos) = (0.5 * angle).sin_cos();
                *frame *= turned(before, cos, sin);
                Some(pose(frame))
            });
        Ok(links.collect())
    }

    /// Fills `state` with the tool pose and the joint axes at `theta` \[rad\], without allocating.
    ///
    /// # Errors
    /// [`ArmError::JointCount`] where `theta` or `state` do not fit this arm.
    pub fn evaluate(&self, theta: &[f64], state: &mut ArmState) -> Result<(), ArmError> {
        self.check_count(theta)?;
        let mut axes = state.axes_mut(self.joint_count())?.iter_mut();
        let end = self.for_each_joint(theta, |direction, point| {
            if let Some(axis) = axes.next() {
                (axis.direction, axis.point) = (direction, point);
            }
        });
        let (base_from_tool, tool_point) = end.tool(self.last_link_from_tool.as_ref());
        state.set_tool(base_from_tool, tool_point);
        Ok(())
    }

    /// Calls `each` with the axis of each joint, base first, by its direction and a point on it; returns the last link.
    #[inline]
    fn for_each_joint(&self, theta: &[f64], mut each: impl FnMut(Vector3<f64>, Vector3<f64>)) -> ChainEnd {
        let mut end = self.first_turn;
        let blocks = self.links.chunks(BLOCK).zip(self.half_angles.chunks(BLOCK)).zip(theta.chunks(BLOCK));
        for ((links, offsets), angles) in blocks {
            let (mut cosines, mut sines) = ([[0.0; 2]; BLOCK / 2], [[0.0; 2]; BLOCK / 2]);
            let slots = cosines.iter_mut().zip(&mut sines);
            for ((angles, offsets), (cosines, sines)) in angles.chunks(2).zip(offsets.chunks(2)).zip(slots) {
                let (cos, sin) = half_turns(two(angles), two(offsets));
                (*cosines, *sines) = (cos.to_array(), sin.to_array());
            }
            for ((link, cos), sin) in links.iter().zip(cosines.as_flattened()).zip(sines.as_flattened()) {
                end.follow(link);
                each(end.z_axis(), end.point);
                end.turn(*cos, *sin);
            }
        }
        end
    }

    /// The tool in the last link.
    pub fn last_link_from_tool(&self) -> UnitDualQuaternion {
        ChainEnd::turned(0.0).tool(self.last_link_from_tool.as_ref()).0
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

/// The first two numbers, or one and 0.
#[inline(always)]
fn two(numbers: &[f64]) -> f64x2 {
    match numbers {
        [first, second, ..] => f64x2::new([*first, *second]),
        [first] => f64x2::new([*first, 0.0]),
        [] => f64x2::ZERO,
    }
}

/// The frame as a dual quaternion of the same sign.
fn pose(frame: &Isometry3<f64>) -> UnitDualQuaternion {
    UnitDualQuaternion::from_parts(frame.rotation, frame.translation.vector)
}
