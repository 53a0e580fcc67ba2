//! The state of an arm at given joint positions: the tool pose, the motion of the tool by each joint, and Jacobians.

use super::ArmError;
use super::pair::{Motions, Pair, ZEROS, beside, dot, put};
use dq_algebra::{UnitDualQuaternion, Vector8};
use nalgebra::{Matrix6xX, OMatrix, Quaternion, U8, UnitQuaternion, Vector3, Vector6};

/// The tool pose of an arm, and the motion of the tool by each joint. [`Chain::evaluate`](super::Chain::evaluate) computes them
/// without allocating.
#[derive(Clone, Debug, PartialEq)]
pub struct ArmState {
    rotation: UnitQuaternion<f64>,
    tool_point: Vector3<f64>,
    joint_count: usize,
    /// The motions of the tool by pairs of joints. If the number of joints is odd, the second motion of the last pair is zero.
    motions: Vec<Motions>,
}

impl ArmState {
    /// Creates a state for `joint_count` joints. The motions are not computed yet.
    pub(super) fn of_joints(joint_count: usize) -> Self {
        Self {
            rotation: UnitQuaternion::identity(),
            tool_point: Vector3::zeros(),
            joint_count,
            motions: vec![STILL; joint_count.div_ceil(2)],
        }
    }

    /// Combines two arms into one (paper §4). See [`set_relative`](Self::set_relative).
    pub fn relative(left: &Self, right: &Self) -> Self {
        let mut state = Self::of_joints(left.joint_count + right.joint_count);
        state.set_relative(left, right);
        state
    }

    /// Sets this state to the state of two arms as one: its base is the tool of `left`, and its tool is the tool of `right`. Its
    /// pose is `q_r = q_2* q_1` (eq. 22). Its joints are the joints of `left` (the paper's β, arm 2), then the joints of `right`
    /// (α, arm 1).
    ///
    /// Let `(l, v)` be the angular and the linear motion that a joint gives the tool of its own arm. Relative to the left tool, a
    /// joint of the right arm then moves the right tool by `(l, v)`, and a joint of the left arm by `−(l, v + l × (t_1 − t_2))`.
    /// Here t_1 and t_2 are the tool points of the right and the left arm. Both arms must have the same base frame. The laws then
    /// treat both arms as one. Allocates only if the state had another number of joints.
    pub fn set_relative(&mut self, left: &Self, right: &Self) {
        let joint_count = left.joint_count + right.joint_count;
        if self.joint_count != joint_count {
            *self = Self::of_joints(joint_count);
        }
        let left_from_base = left.rotation.inverse();
        let way = right.tool_point - left.tool_point;
        let lefts = left.tool_motions().map(|(l, v)| (-l, -(v + l.cross(&way))));
        let mut all = lefts
            .chain(right.tool_motions())
            .map(|(angular, linear)| (left_from_base * angular, left_from_base * linear));
        for pair in &mut self.motions {
            let [first, second] = [all.next(), all.next()].map(Option::unwrap_or_default);
            *pair = (beside(&first.0, &second.0), beside(&first.1, &second.1));
        }
        self.set_tool(left_from_base * right.rotation, left_from_base * way);
    }

    /// Returns the number of joints.
    pub fn joint_count(&self) -> usize {
        self.joint_count
    }

    /// Returns the tool pose.
    #[inline]
    pub fn base_from_tool(&self) -> UnitDualQuaternion {
        UnitDualQuaternion::from_parts(self.rotation, self.tool_point)
    }

    /// Returns the orientation of the tool.
    #[inline]
    pub fn rotation(&self) -> UnitQuaternion<f64> {
        self.rotation
    }

    /// Returns the tool's position in the base frame \[m\].
    pub fn tool_point(&self) -> Vector3<f64> {
        self.tool_point
    }

    /// Returns the pose Jacobian, 8×n: `d(base_from_tool)/dt = J θ̇` (eq. 15). Column i is `½ (l + ε p×l) q`, or
    /// `½ ε l q` for a prismatic joint. The axis of joint i has the direction l through the point p, and q is the tool pose.
    pub fn pose_jacobian(&self) -> OMatrix<f64, U8, nalgebra::Dyn> {
        let mut columns = Vec::with_capacity(self.joint_count);
        self.for_each_pose_column(|column| columns.push(column));
        OMatrix::from_columns(&columns)
    }

    /// Calls `each` with each column of the pose Jacobian, base first. Does not allocate.
    pub fn for_each_pose_column(&self, mut each: impl FnMut(Vector8)) {
        let (half_tool, half) = (0.5 * self.tool_point, 0.5 * self.rotation.into_inner());
        // The product of two quaternions, the first one without a scalar part.
        let times = |v: &Vector3<f64>| {
            Quaternion::from_parts(-v.dot(&half.imag()), half.w * v + v.cross(&half.imag()))
        };
        for (line, linear) in self.tool_motions() {
            let real = times(&line);
            let dual = times(&(linear + half_tool.cross(&line))) - half * half_tool.dot(&line);
            each(Vector8::from([real.w, real.i, real.j, real.k, dual.w, dual.i, dual.j, dual.k]));
        }
    }

    /// Yields, for each joint, the motion that it gives the tool, along the base's axes: `(l, l × (t − p))` [rad/rad, m/rad],
    /// prismatic: `(0, l)` [rad/m, m/m]. The joint's axis has the direction l through the point p, and t is the tool point. Does
    /// not allocate.
    pub fn tool_motions(&self) -> impl Iterator<Item = (Vector3<f64>, Vector3<f64>)> + '_ {
        let of = |pair: &Pair, i: usize| pair.map(|numbers| numbers.to_array()[i % 2]);
        (0..self.joint_count).map(move |i| {
            let (angular, linear) = &self.motions[i / 2];
            (of(angular, i), of(linear, i))
        })
    }

    /// Returns the motions of [`tool_motions`](Self::tool_motions) for pairs of joints.
    pub(crate) fn tool_motion_pairs(&self) -> &[Motions] {
        &self.motions
    }

    /// Sets `to` to `Jᵀ` times a moment and a force at the tool point, along the base's axes: the load of each joint. Both halves
    /// of each register in the moment and the force must contain the same number.
    #[inline]
    pub(crate) fn apply_transpose(&self, (moment, force): &Motions, to: &mut [f64]) {
        for (room, (angular, linear)) in to.chunks_mut(2).zip(&self.motions) {
            put(dot(angular, moment) + dot(linear, force), room);
        }
    }

    /// Yields the columns of the twist Jacobian at the tool, along the base's axes. Does not allocate.
    pub fn tool_columns(&self) -> impl Iterator<Item = Vector6<f64>> + '_ {
        self.tool_motions().map(|(angular, linear)| {
            Vector6::new(angular.x, angular.y, angular.z, linear.x, linear.y, linear.z)
        })
    }

    /// Returns the body-twist Jacobian J, 6×n: `J θ̇` is the twist `(ω, v)` of the tool, along the tool's axes.
    pub fn body_jacobian(&self) -> Matrix6xX<f64> {
        let columns: Vec<_> = self.body_columns().collect();
        Matrix6xX::from_columns(&columns)
    }

    /// Yields the columns of the body-twist Jacobian, `(Rᵀl, Rᵀ(l × (t − p)))`, prismatic: `(0, Rᵀl)`. R is the rotation matrix of
    /// the tool; l, t and p are as in [`tool_motions`](Self::tool_motions). Does not allocate.
    pub fn body_columns(&self) -> impl Iterator<Item = Vector6<f64>> + '_ {
        let tool_from_base = self.rotation.inverse().to_rotation_matrix();
        self.tool_motions().map(move |(angular, linear)| {
            let (angular, linear) = (tool_from_base * angular, tool_from_base * linear);
            Vector6::new(angular.x, angular.y, angular.z, linear.x, linear.y, linear.z)
        })
    }

    /// Returns the tool's twist `(ω, v)` [rad/s, m/s], along the base's axes. `theta_dot` are the joint velocities [rad/s,
    /// prismatic: m/s].
    pub fn tool_twist(&self, theta_dot: &[f64]) -> (Vector3<f64>, Vector3<f64>) {
        let motions = self.tool_motions().zip(theta_dot);
        motions.fold(Default::default(), |(angular, linear), ((l, v), speed)| {
            (angular + l * *speed, linear + v * *speed)
        })
    }

    pub(super) fn set_tool(&mut self, rotation: UnitQuaternion<f64>, tool_point: Vector3<f64>) {
        (self.rotation, self.tool_point) = (rotation, tool_point);
    }

    pub(super) fn motions_mut(&mut self, expected: usize) -> Result<&mut [Motions], ArmError> {
        match self.joint_count == expected {
            true => Ok(&mut self.motions),
            false => Err(ArmError::JointCount { expected, got: self.joint_count }),
        }
    }
}

/// The motions that two joints give the tool if neither joint moves the tool: zeros.
const STILL: Motions = (ZEROS, ZEROS);
