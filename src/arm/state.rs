//! An arm at given joint angles: tool pose, joint axes and the Jacobians they give.

use super::{ArmError, Chain, JointKind};
use crate::dq::{UnitDualQuaternion, Vector8};
use nalgebra::{Matrix6xX, OMatrix, Quaternion, U8, Vector3, Vector6};

/// The line about which a joint turns, or along which it slides, in the base frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointAxis {
    /// What it does.
    pub kind: JointKind,
    /// Along the line, of length 1.
    pub direction: Vector3<f64>,
    /// On the line \[m\].
    pub point: Vector3<f64>,
}

impl JointAxis {
    /// How the joint turns what it carries, for each unit of its own speed.
    pub fn angular(&self) -> Vector3<f64> {
        match self.kind {
            JointKind::Revolute => self.direction,
            JointKind::Prismatic => Vector3::zeros(),
        }
    }

    /// The velocity that the joint gives a point that it carries, for each unit of its own speed: `l × (t − p)` \[m/rad\], or `l`.
    pub fn linear(&self, point: &Vector3<f64>) -> Vector3<f64> {
        match self.kind {
            JointKind::Revolute => self.direction.cross(&(point - self.point)),
            JointKind::Prismatic => self.direction,
        }
    }

    /// The moment about the axis, or the force along it, of a moment about the base's origin and a force there.
    pub fn give_way(&self, moment: &Vector3<f64>, force: &Vector3<f64>) -> f64 {
        match self.kind {
            JointKind::Revolute => self.direction.dot(&(moment + force.cross(&self.point))),
            JointKind::Prismatic => self.direction.dot(force),
        }
    }
}

/// Tool pose and joint axes of an arm; [`Chain::evaluate`] fills it without allocating.
#[derive(Clone, Debug, PartialEq)]
pub struct ArmState {
    base_from_tool: UnitDualQuaternion,
    tool_point: Vector3<f64>,
    axes: Vec<JointAxis>,
}

impl ArmState {
    /// The arm with all joints at 0.
    pub fn new(chain: &Chain) -> Self {
        let axis =
            |kind: &JointKind| JointAxis { kind: *kind, direction: Vector3::z(), point: Vector3::zeros() };
        let mut state = Self {
            base_from_tool: UnitDualQuaternion::identity(),
            tool_point: Vector3::zeros(),
            axes: chain.kinds().iter().map(axis).collect(),
        };
        // The counts are equal by construction.
        let _ = chain.evaluate(&vec![0.0; chain.joint_count()], &mut state);
        state
    }

    /// Two arms as one (paper §4): [`set_relative`](Self::set_relative) on a state of its own.
    pub fn relative(left: &Self, right: &Self) -> Self {
        let mut state = Self { axes: left.axes.iter().chain(&right.axes).copied().collect(), ..left.clone() };
        state.set_relative(left, right);
        state
    }

    /// Becomes the arm whose base is the tool of `left` and whose tool is that of `right`: its pose is
    /// `q_r = q_2* q_1` (eq. 22), its joints are those of `left` (the paper's β, arm 2), then those of `right` (α, arm 1).
    ///
    /// Seen from the left tool, a joint of the right arm moves the right tool about or along its axis line, and a joint of the left
    /// arm moves it the other way. So everything that holds for one arm holds for this one, with twice the joints, as
    /// long as both states are in one base frame. A state for another number of joints is filled as far as it goes.
    pub fn set_relative(&mut self, left: &Self, right: &Self) {
        let left_from_base = left.base_from_tool.rotation().inverse();
        let seen = |axis: &JointAxis, sign: f64| JointAxis {
            kind: axis.kind,
            direction: left_from_base * (sign * axis.direction),
            point: left_from_base * (axis.point - left.tool_point),
        };
        let axes = left
            .axes
            .iter()
            .map(|axis| seen(axis, -1.0))
            .chain(right.axes.iter().map(|axis| seen(axis, 1.0)));
        for (slot, axis) in self.axes.iter_mut().zip(axes) {
            *slot = axis;
        }
        let left_from_right = left.base_from_tool.conjugate() * right.base_from_tool;
        self.set_tool(left_from_right, left_from_base * (right.tool_point - left.tool_point));
    }

    /// The number of joints.
    pub fn joint_count(&self) -> usize {
        self.axes.len()
    }

    /// The tool pose.
    pub fn base_from_tool(&self) -> UnitDualQuaternion {
        self.base_from_tool
    }

    /// The tool's position in the base frame \[m\].
    pub fn tool_point(&self) -> Vector3<f64> {
        self.tool_point
    }

    /// The joint axes in the base frame, base first.
    pub fn axes(&self) -> impl Iterator<Item = &JointAxis> + '_ {
        self.axes.iter()
    }

    /// The pose Jacobian, 8×n: `d(base_from_tool)/dt = J θ̇` (eq. 15). Column i is `½ (l + ε p×l) q` with the joint's axis
    /// line (direction l, point p), and `½ ε l q` for a prismatic joint.
    pub fn pose_jacobian(&self) -> OMatrix<f64, U8, nalgebra::Dyn> {
        let columns: Vec<_> = self.pose_columns().collect();
        OMatrix::from_columns(&columns)
    }

    /// The columns of the pose Jacobian, without allocating.
    pub fn pose_columns(&self) -> impl Iterator<Item = Vector8> + '_ {
        let (real, dual) = (self.base_from_tool.real(), self.base_from_tool.dual());
        self.axes().map(move |axis| {
            let line = Quaternion::from_imag(0.5 * axis.angular());
            let moment = Quaternion::from_imag(0.5 * axis.linear(&Vector3::zeros()));
            let (r, d) = (line * real, line * dual + moment * real);
            Vector8::from([r.w, r.i, r.j, r.k, d.w, d.i, d.j, d.k])
        })
    }

    /// The velocity of the tool point that each joint gives, `l × (t − p)` [m/rad], prismatic: l \[m/m\], without allocating.
    pub fn point_columns(&self) -> impl Iterator<Item = Vector3<f64>> + '_ {
        self.axes().map(|axis| axis.linear(&self.tool_point))
    }

    /// What each joint does to the tool, along the base's axes: `(l, l × (t − p))` [rad/rad, m/rad], prismatic: `(0, l)`
    /// [rad/m, m/m], without allocating.
    pub fn tool_motions(&self) -> impl Iterator<Item = (Vector3<f64>, Vector3<f64>)> + '_ {
        self.axes().map(|axis| (axis.angular(), axis.linear(&self.tool_point)))
    }

    /// The columns of the twist Jacobian at the tool along the base's axes, without allocating.
    pub fn tool_columns(&self) -> impl Iterator<Item = Vector6<f64>> + '_ {
        self.tool_motions().map(|(angular, linear)| {
            Vector6::new(angular.x, angular.y, angular.z, linear.x, linear.y, linear.z)
        })
    }

    /// The body-twist Jacobian, 6×n: `(ω, v)` of the tool in its own frame is `J θ̇`.
    pub fn body_jacobian(&self) -> Matrix6xX<f64> {
        let columns: Vec<_> = self.body_columns().collect();
        Matrix6xX::from_columns(&columns)
    }

    /// The columns of the body-twist Jacobian, `(Rᵀl, Rᵀ(l × (t − p)))`, prismatic: `(0, Rᵀl)`, without allocating.
    pub fn body_columns(&self) -> impl Iterator<Item = Vector6<f64>> + '_ {
        let tool_from_base = self.base_from_tool.rotation().inverse().to_rotation_matrix();
        self.tool_motions().map(move |(angular, linear)| {
            let (angular, linear) = (tool_from_base * angular, tool_from_base * linear);
            Vector6::new(angular.x, angular.y, angular.z, linear.x, linear.y, linear.z)
        })
    }

    /// The tool's twist `(ω, v)` [rad/s, m/s] along the base's axes at joint velocities `theta_dot` [rad/s, prismatic: m/s].
    pub fn tool_twist(&self, theta_dot: &[f64]) -> (Vector3<f64>, Vector3<f64>) {
        let zero = (Vector3::zeros(), Vector3::zeros());
        self.tool_motions()
            .zip(theta_dot)
            .fold(zero, |(angular, linear), ((l, v), speed)| (angular + *speed * l, linear + *speed * v))
    }

    pub(super) fn set_tool(&mut self, base_from_tool: UnitDualQuaternion, tool_point: Vector3<f64>) {
        (self.base_from_tool, self.tool_point) = (base_from_tool, tool_point);
    }

    pub(super) fn axes_mut(&mut self, expected: usize) -> Result<&mut [JointAxis], ArmError> {
        match self.axes.len() == expected {
            true => Ok(&mut self.axes),
            false => Err(ArmError::JointCount { expected, got: self.axes.len() }),
        }
    }
}
