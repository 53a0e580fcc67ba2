//! A serial chain of revolute and prismatic joints, and its forward kinematics.

use super::coupling::Drivers;
use super::half_turns::half_turns;
use super::link::{ChainEnd, Kinds, Link, LinkPair};
use super::pair::{twice, two};
use super::{ArmError, ArmState, Convention, DhRow, Joint, JointKind, bounds};
use dq_algebra::UnitDualQuaternion;
use nalgebra::{Isometry3, Quaternion, Unit, UnitQuaternion, Vector3};
use wide::f64x2;

/// Two axes count as perpendicular if the size of the dot product of their directions is at most this.
const SQUARE: f64 = 1e-9;

/// A serial arm with any number of revolute and prismatic joints.
///
/// The chain has the same form for both DH conventions and for joints about any axes. Each joint turns about z or slides along z
/// after a fixed transform. A fixed transform to the tool follows the last joint.
#[derive(Clone, Debug, PartialEq)]
pub struct Chain {
    /// For each joint at position 0, its frame relative to the previous link or the base. The joint turns about z or slides along z
    /// of this frame.
    before_joint: Vec<Isometry3<f64>>,
    /// The kind of motion of each link relative to the previous link.
    pub(super) link_kinds: Vec<JointKind>,
    /// The joint that moves each link; `None` if each link has its own joint.
    pub(super) drivers: Option<Drivers>,
    /// The frame of the tool without its offset (the flange), relative to the last link; `None` if it is the last link's frame.
    last_link_from_flange: Option<Isometry3<f64>>,
    /// The frame of the tool, relative to the last link; `None` if it is the last link's frame.
    last_link_from_tool: Option<Isometry3<f64>>,
    tool_offset: UnitDualQuaternion,
    /// The links, base first, two in each pair. The last pair may have a single link.
    pairs: Vec<LinkPair>,
    /// The rotation about z before the first joint.
    first_turn: ChainEnd,
    /// The position of the arm's base.
    base_point: Vector3<f64>,
}

impl Chain {
    /// Creates a chain from DH rows, base first.
    ///
    /// # Errors
    /// [`ArmError::NoJoints`], [`ArmError::NonFinite`] or [`ArmError::OutOfRange`].
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
        Ok(Self::of(before, vec![JointKind::Revolute; rows.len()], last_link_from_tool))
    }

    /// Creates a chain from joints, base first. `last_joint_from_tool` is the pose of the tool in the last joint's frame.
    ///
    /// # Errors
    /// [`ArmError::NoJoints`], [`ArmError::NonFinite`] or [`ArmError::OutOfRange`]. An axis of zeros also gives
    /// [`ArmError::NonFinite`], because `Unit::new_normalize` makes NaN of it.
    pub fn from_joints(
        joints: &[Joint],
        last_joint_from_tool: &UnitDualQuaternion,
    ) -> Result<Self, ArmError> {
        if joints.is_empty() {
            return Err(ArmError::NoJoints);
        }
        let mut before_joint = Vec::with_capacity(joints.len());
        // The transform from the frame whose z axis is the last joint's axis to that joint's own frame.
        let mut z_from_joint = Isometry3::identity();
        for (i, joint) in joints.iter().enumerate() {
            bounds::length("origin", i + 1, joint.parent_from_joint.translation().norm())?;
            if let Some(value) = joint.axis.iter().copied().find(|x| !x.is_finite()) {
                return Err(ArmError::NonFinite { parameter: "axis", joint: i + 1, value });
            }
            let joint_from_z = Isometry3::from_parts(Vector3::zeros().into(), from_z(&joint.axis));
            before_joint.push(z_from_joint * joint.parent_from_joint.frame() * joint_from_z);
            z_from_joint = joint_from_z.inverse();
        }
        bounds::length("tool", joints.len(), last_joint_from_tool.translation().norm())?;
        let kinds = joints.iter().map(|joint| joint.kind).collect();
        Ok(Self::of(before_joint, kinds, z_from_joint * last_joint_from_tool.frame()))
    }

    fn of(
        before_joint: Vec<Isometry3<f64>>,
        link_kinds: Vec<JointKind>,
        last_link_from_tool: Isometry3<f64>,
    ) -> Self {
        let last_link_from_flange = Some(last_link_from_tool).filter(|tool| *tool != Isometry3::identity());
        let chain = Self {
            before_joint,
            link_kinds,
            drivers: None,
            last_link_from_flange,
            last_link_from_tool: last_link_from_flange,
            tool_offset: UnitDualQuaternion::identity(),
            pairs: Vec::new(),
            first_turn: ChainEnd::turned(0.0),
            base_point: Vector3::zeros(),
        };
        chain.with_links()
    }

    /// Returns the kind of each joint, base first.
    pub fn kinds(&self) -> &[JointKind] {
        self.drivers.as_ref().map_or(&self.link_kinds, |drivers| &drivers.kinds)
    }

    /// Computes the pairs of links and the first rotation again, from the fixed transforms.
    fn with_links(mut self) -> Self {
        let links: Vec<_> = self.before_joint.iter().map(Link::new).collect();
        let befores = links.iter().map(|(_, before, _)| *before);
        self.first_turn = ChainEnd::turned(befores.clone().next().unwrap_or(0.0));
        let ends = befores.skip(1).chain([0.0]);
        let joints: Vec<_> = links
            .iter()
            .zip(ends)
            .zip(&self.link_kinds)
            .map(|(((link, _, after), next), kind)| (*link, after + next, *kind))
            .collect();
        self.pairs = joints.chunks(2).map(LinkPair::new).collect();
        self
    }

    /// Returns the number of joints.
    pub fn joint_count(&self) -> usize {
        self.kinds().len()
    }

    /// Returns the number of links that move. It is the number of joints, or more if a joint moves several links.
    pub fn link_count(&self) -> usize {
        self.before_joint.len()
    }

    /// Returns the same arm with its base at `world_from_base`. The arm's base frame is then the world.
    pub fn standing_at(mut self, world_from_base: &UnitDualQuaternion) -> Self {
        if let Some(first) = self.before_joint.first_mut() {
            *first = world_from_base.frame() * *first;
        }
        self.base_point = world_from_base.rotation() * self.base_point + world_from_base.translation();
        self.with_links()
    }

    /// Sets the tool offset: the pose of the tool relative to the flange. The flange is the frame that the tool has without an
    /// offset.
    pub fn set_tool_offset(&mut self, flange_from_tool: &UnitDualQuaternion) {
        self.tool_offset = *flange_from_tool;
        let flange = self.last_link_from_flange;
        self.last_link_from_tool = match *flange_from_tool == UnitDualQuaternion::identity() {
            true => flange,
            false => Some(flange.unwrap_or_else(Isometry3::identity) * flange_from_tool.frame()),
        };
    }

    /// Returns the tool offset: the pose of the tool relative to the flange. The flange is the frame that the tool has without an
    /// offset.
    pub fn tool_offset(&self) -> &UnitDualQuaternion {
        &self.tool_offset
    }

    /// Returns the position of the arm's base \[m\].
    pub fn base_point(&self) -> Vector3<f64> {
        self.base_point
    }

    /// Returns an upper bound of the distance from the arm's base to its tool \[m\] while the joints are within `ranges` \[rad,
    /// prismatic: m\]. A prismatic joint without a range counts as fixed at 0.
    pub fn reach(&self, ranges: impl Iterator<Item = (f64, f64)> + Clone) -> f64 {
        self.length_from(0, self.link_ranges(ranges))
    }

    /// Returns two lengths \[m\] for joints within `ranges` \[rad, prismatic: m\]. The first is the distance of `point` from the
    /// nearest position that the arm's foot can have. The second is an upper bound of the distance from the foot to the tool.
    ///
    /// Usually the foot is the base. If the chain begins with prismatic joints whose axes are perpendicular to each other, the foot is
    /// the frame of the last of these joints. A single prismatic joint is enough.
    pub fn gap(&self, point: &Vector3<f64>, ranges: impl Iterator<Item = (f64, f64)> + Clone) -> (f64, f64) {
        let ranges = self.link_ranges(ranges);
        let (mut foot, mut axes, mut count) = (Isometry3::identity(), [Vector3::zeros(); 3], 0);
        for before in self
            .before_joint
            .iter()
            .zip(&self.link_kinds)
            .map_while(|(before, kind)| (*kind == JointKind::Prismatic).then_some(before))
        {
            let next = foot * before;
            let axis = next.rotation * Vector3::z();
            if count == axes.len() || axes.iter().any(|other| other.dot(&axis).abs() > SQUARE) {
                break;
            }
            (foot, axes[count]) = (next, axis);
            count += 1;
        }
        let foot = if count == 0 { self.base_point } else { foot.translation.vector };
        let mut way = point - foot;
        for (axis, (lower, upper)) in axes[..count].iter().zip(ranges.clone()) {
            way -= axis * axis.dot(&way).max(lower).min(upper);
        }
        (way.norm(), self.length_from(count, ranges))
    }

    /// Returns the total length of the links from number `first` (counted from 0) to the tool \[m\]. The length includes the travel
    /// of prismatic links within `ranges`, the ranges of all links.
    fn length_from(&self, first: usize, ranges: impl Iterator<Item = (f64, f64)>) -> f64 {
        let starts = std::iter::once(self.base_point).chain(std::iter::repeat(Vector3::zeros()));
        let lengths = self
            .before_joint
            .iter()
            .zip(starts)
            .map(|(before, start)| (before.translation.vector - start).norm());
        let slides = self.link_kinds.iter().zip(ranges).map(|(kind, (lower, upper))| match kind {
            JointKind::Revolute => 0.0,
            JointKind::Prismatic => lower.abs().max(upper.abs()),
        });
        let links = lengths.zip(slides).skip(first).map(|(length, slide)| length + slide);
        let tool = self.last_link_from_tool.map_or(0.0, |tool| tool.translation.vector.norm());
        links.sum::<f64>() + tool
    }

    /// Returns `base_from_tool` at the joint positions `theta` \[rad, prismatic: m\] (eq. 14). This pose is the product of the links'
    /// transforms. Its quaternion keeps the sign of that product.
    ///
    /// # Errors
    /// [`ArmError::JointCount`] if `theta` does not have one number per joint.
    pub fn forward_kinematics(&self, theta: &[f64]) -> Result<UnitDualQuaternion, ArmError> {
        self.check_count(theta)?;
        let end = match &self.drivers {
            None => self.pass_pairs(theta.chunks(2).map(two), |_| ()),
            Some(drivers) => self.pass_pairs(drivers.positions(theta), |_| ()),
        };
        let (rotation, point) = end.tool(self.last_link_from_tool.as_ref());
        Ok(UnitDualQuaternion::from_parts(rotation, point))
    }

    /// Returns `base_from_link` for each link, base first. The z axis of a link's frame is the axis about or along which the link
    /// moves. Unless a joint moves several links, link i moves with joint i.
    ///
    /// # Errors
    /// [`ArmError::JointCount`] if `theta` does not have one number per joint.
    pub fn link_poses(&self, theta: &[f64]) -> Result<Vec<UnitDualQuaternion>, ArmError> {
        self.check_count(theta)?;
        let mut links = Vec::with_capacity(self.link_count());
        self.for_each_link(theta, |link| links.push((*link).into()));
        Ok(links)
    }

    /// Calls `each` with the frames of [`link_poses`](Self::link_poses), base first. If `theta` is too short, ends at the first
    /// link without a joint position. Does not allocate.
    pub fn for_each_link(&self, theta: &[f64], mut each: impl FnMut(&Isometry3<f64>)) {
        let mut frame = Isometry3::identity();
        for (before, (coupling, kind)) in self.before_joint.iter().zip(self.couplings()) {
            let Some(position) = theta.get(coupling.driver).map(|position| coupling.at(*position)) else {
                return;
            };
            let (sin, cos) = (0.5 * position).sin_cos();
            frame *= match kind {
                JointKind::Revolute => turned(before, cos, sin),
                JointKind::Prismatic => before * Isometry3::translation(0.0, 0.0, position),
            };
            each(&frame);
        }
    }

    /// Yields the origin of each joint at position 0, in the frame of the previous link or the base \[m\]. The joint nearest to the
    /// base comes first.
    pub fn joint_origins(&self) -> impl Iterator<Item = Vector3<f64>> + '_ {
        self.before_joint.iter().map(|before| before.translation.vector)
    }

    /// Sets `state` to the tool pose and the joint axes at `theta` \[rad, prismatic: m\], without allocating. `state` may have
    /// been the state of another arm with the same number of joints.
    ///
    /// # Errors
    /// [`ArmError::JointCount`] if `theta` or `state` do not have as many joints as this arm.
    pub fn evaluate(&self, theta: &[f64], state: &mut ArmState) -> Result<(), ArmError> {
        self.check_count(theta)?;
        let motions = state.motions_mut(self.joint_count())?;
        if let Some(drivers) = &self.drivers {
            let tool = self.evaluate_driven(drivers, theta, motions).tool(self.last_link_from_tool.as_ref());
            motions.iter_mut().for_each(|(angular, linear)| *linear += angular.cross(&twice(&tool.1)));
            state.set_tool(tool.0, tool.1);
            return Ok(());
        }
        let mut slots = motions.iter_mut();
        let end = self.pass_pairs(theta.chunks(2).map(two), |ends| {
            if let Some(axes) = slots.next() {
                *axes = ChainEnd::z_axes(ends);
            }
        });
        let (rotation, tool_point) = end.tool(self.last_link_from_tool.as_ref());
        let tool = twice(&tool_point);
        for (motions, pair) in motions.iter_mut().zip(&self.pairs) {
            let (direction, point) = *motions;
            let turned = direction.cross(&(tool - point));
            *motions = match pair.kinds {
                None => (direction, turned),
                Some(Kinds { turns, slides }) => (direction * turns, turned * turns + direction * slides),
            };
        }
        state.set_tool(rotation, tool_point);
        Ok(())
    }

    /// Calls `each` with the frames of two successive links at a time, base first. `positions` are the positions of the links in
    /// pairs. Each link moves about or along the z axis of its frame. Returns the frame of the last link.
    ///
    /// This is fast because the sines and cosines for the next two links are computed while the frames of the present two links are
    /// multiplied.
    #[inline]
    pub(super) fn pass_pairs(
        &self,
        positions: impl Iterator<Item = f64x2>,
        mut each: impl FnMut(&[ChainEnd; 2]),
    ) -> ChainEnd {
        let mut end = self.first_turn;
        let mut turned = self.pairs.iter().zip(positions).map(|(pair, positions)| {
            let angles = pair.kinds.map_or(positions, |kinds| positions * kinds.turns);
            (pair, positions - angles, half_turns(angles, pair.half_angles))
        });
        let mut ahead = turned.next();
        while let Some((pair, slid, (cosines, sines))) = ahead {
            ahead = turned.next();
            let (slid, cosines, sines) = (slid.to_array(), cosines.to_array(), sines.to_array());
            let mut pass = |i: usize| {
                end.follow(&pair.links[i]);
                if pair.kinds.is_some() {
                    end.advance(slid[i] * end.z_axis());
                }
                let axis = end;
                end.turn(cosines[i], sines[i]);
                axis
            };
            let ends = [pass(0), pass(1)];
            each(&ends);
        }
        end
    }

    /// Returns the pose of the tool relative to the last link.
    pub fn last_link_from_tool(&self) -> UnitDualQuaternion {
        let (rotation, point) = ChainEnd::turned(0.0).tool(self.last_link_from_tool.as_ref());
        UnitDualQuaternion::from_parts(rotation, point)
    }

    /// Returns the pose of each joint at position 0 relative to the previous link or the base, base first.
    pub fn parent_from_joint(&self) -> Vec<UnitDualQuaternion> {
        self.before_joint.iter().map(|frame| (*frame).into()).collect()
    }

    fn check_count(&self, theta: &[f64]) -> Result<(), ArmError> {
        match theta.len() == self.joint_count() {
            true => Ok(()),
            false => Err(ArmError::JointCount { expected: self.joint_count(), got: theta.len() }),
        }
    }
}

/// Returns the frame rotated about its own z axis. `cos` and `sin` are the cosine and sine of half the angle.
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

/// Returns a rotation that takes z to `direction`. If `direction` points upward, the result is the shortest such rotation.
/// Otherwise the result is a half turn about x, followed by the shortest rotation from −z. The result is accurate to rounding
/// everywhere, whereas a formula with the arc cosine is inaccurate near the poles.
fn from_z(direction: &Unit<Vector3<f64>>) -> UnitQuaternion<f64> {
    let (x, y, z) = (direction.x, direction.y, direction.z);
    UnitQuaternion::new_normalize(match z >= 0.0 {
        true => Quaternion::new(1.0 + z, -y, x, 0.0),
        false => Quaternion::new(-y, 1.0 - z, 0.0, x),
    })
}

impl ArmState {
    /// Creates the state of an arm with all joints at 0.
    pub fn new(chain: &Chain) -> Self {
        let mut state = Self::of_joints(chain.joint_count());
        // The counts are equal by construction.
        let _ = chain.evaluate(&vec![0.0; chain.joint_count()], &mut state);
        state
    }
}
