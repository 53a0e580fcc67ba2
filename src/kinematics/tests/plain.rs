//! The control step written directly by its formulas, with products of dual quaternions, 6×6 and 8×n matrices and their
//! decompositions. The tests compare the program's own, faster control step with this one, to 1e-12. The benchmark `control_step`
//! compares the times of both.

use dq_algebra::{UnitDualQuaternion, Vector8};
use dq_kinematics::arm::{Convention, DhRow};
use dq_kinematics::control::Damping;
use nalgebra::{Cholesky, Matrix6, Quaternion, Vector3, Vector6};

/// An arm from DH rows, whose transforms are computed factor by factor.
pub struct PlainArm {
    before_joint: Vec<UnitDualQuaternion>,
    tool: UnitDualQuaternion,
    pub base_from_tool: UnitDualQuaternion,
    /// The direction of each joint's axis, and a point on it.
    pub axes: Vec<(Vector3<f64>, Vector3<f64>)>,
}

fn turn(angle: f64, axis: nalgebra::Unit<Vector3<f64>>) -> UnitDualQuaternion {
    UnitDualQuaternion::from_translation_angle_axis(Vector3::zeros(), angle, &axis)
}

fn shift(x: f64, z: f64) -> UnitDualQuaternion {
    UnitDualQuaternion::from_translation_angle_axis(Vector3::new(x, 0.0, z), 0.0, &Vector3::z_axis())
}

impl PlainArm {
    pub fn new(convention: Convention, rows: &[DhRow]) -> Self {
        let offset = |row: &DhRow| turn(row.theta_offset, Vector3::z_axis());
        let link = |row: &DhRow| (turn(row.alpha, Vector3::x_axis()), shift(row.a, row.d));
        let (mut before_joint, mut tool) = (Vec::new(), UnitDualQuaternion::identity());
        for row in rows {
            let (twist, along) = link(row);
            match convention {
                Convention::ModifiedDh => before_joint.push(twist * along * offset(row)),
                Convention::StandardDh => {
                    before_joint.push(tool * offset(row));
                    tool = along * twist;
                }
            }
        }
        Self { before_joint, tool, base_from_tool: UnitDualQuaternion::identity(), axes: Vec::new() }
    }

    pub fn evaluate(&mut self, theta: &[f64]) {
        let mut base_from_link = UnitDualQuaternion::identity();
        self.axes.clear();
        for (before, angle) in self.before_joint.iter().zip(theta) {
            let base_from_joint = base_from_link * *before;
            self.axes.push((base_from_joint.rotation() * Vector3::z(), base_from_joint.translation()));
            base_from_link = base_from_joint * turn(*angle, Vector3::z_axis());
        }
        self.base_from_tool = base_from_link * self.tool;
    }

    /// Yields the columns `½ (l + ε p×l) q` of the 8×n pose Jacobian. The joint's axis has the direction l through the point p, and q
    /// is the tool pose.
    pub fn pose_columns(&self) -> impl Iterator<Item = Vector8> + '_ {
        let (real, dual) = (self.base_from_tool.real(), self.base_from_tool.dual());
        self.axes.iter().map(move |(direction, point)| {
            let line = Quaternion::from_imag(0.5 * direction);
            let moment = Quaternion::from_imag(0.5 * point.cross(direction));
            let (r, d) = (line * real, line * dual + moment * real);
            Vector8::from([r.w, r.i, r.j, r.k, d.w, d.i, d.j, d.k])
        })
    }

    /// Yields the columns of the body Jacobian.
    fn body_columns(&self) -> impl Iterator<Item = Vector6<f64>> + '_ {
        let tool_from_base = self.base_from_tool.rotation().inverse().to_rotation_matrix();
        let tool_point = self.base_from_tool.translation();
        self.axes.iter().map(move |(direction, point)| {
            let angular = tool_from_base * direction;
            let linear = tool_from_base * direction.cross(&(tool_point - point));
            Vector6::new(angular.x, angular.y, angular.z, linear.x, linear.y, linear.z)
        })
    }

    fn gram(&self) -> Matrix6<f64> {
        self.body_columns().fold(Matrix6::zeros(), |sum, column| sum + column * column.transpose())
    }

    pub fn smallest_singular_value(&self) -> f64 {
        self.gram().symmetric_eigenvalues().min().max(0.0).sqrt()
    }

    /// Computes diffc: `K Jᵀ (q_d − q)`.
    pub fn diffc(&self, gain: f64, goal: &UnitDualQuaternion, theta_dot: &mut [f64]) {
        let error = goal.to_vector8() - self.base_from_tool.to_vector8();
        for (speed, column) in theta_dot.iter_mut().zip(self.pose_columns()) {
            *speed = gain * column.dot(&error);
        }
    }

    /// Computes logc: `J⁺` times `−K X`, with the logarithm X of the pose error.
    pub fn logc(&self, gains: [f64; 2], damping: &Damping, goal: &UnitDualQuaternion, theta_dot: &mut [f64]) {
        let log = (goal.inverse() * self.base_from_tool).screw_log();
        self.damped(&scaled(gains, log), damping, theta_dot);
    }

    /// Computes double_geodesic: `J⁺` times the rotation vector and the translation to the goal.
    pub fn double_geodesic(
        &self,
        gains: [f64; 2],
        damping: &Damping,
        goal: &UnitDualQuaternion,
        theta_dot: &mut [f64],
    ) {
        let error = goal.inverse() * self.base_from_tool;
        let way = error.rotation().inverse() * error.translation();
        let turn = 2.0 * error.half_log().fixed_rows::<3>(0);
        let twist = Vector6::new(turn.x, turn.y, turn.z, way.x, way.y, way.z);
        self.damped(&scaled(gains, twist), damping, theta_dot);
    }

    fn damped(&self, twist: &Vector6<f64>, damping: &Damping, theta_dot: &mut [f64]) {
        let gram = self.gram();
        let smallest = gram.symmetric_eigenvalues().min().max(0.0).sqrt();
        let damped = gram + Matrix6::identity() * damping.lambda_squared(smallest);
        let solution = Cholesky::new(damped).unwrap().solve(twist);
        for (speed, column) in theta_dot.iter_mut().zip(self.body_columns()) {
            *speed = column.dot(&solution);
        }
    }
}

fn scaled(gains: [f64; 2], error: Vector6<f64>) -> Vector6<f64> {
    let [k, l] = gains.map(|gain| -gain);
    error.component_mul(&Vector6::new(k, k, k, l, l, l))
}
