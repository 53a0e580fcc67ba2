//! Chains, with the kinematics and Jacobians of one or many configurations.

use super::arrays::{Numbers, Rows, array, matrix, rows, slice, table, wrong};
use super::pose::Pose;
use dq_config::{ARMS, ForArm};
use dq_description::Description;
use dq_kinematics::arm::{self, ArmState, Convention, DhRow};
use nalgebra::{Matrix6xX, Vector6};
use numpy::ndarray::{Array3, ArrayView2};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArray3};
use pyo3::prelude::*;

/// A serial arm of revolute and prismatic joints.
#[pyclass(frozen, module = "dq_servo")]
pub(super) struct Chain(pub arm::Chain);

/// Returns the names of the built-in arms.
#[pyfunction]
pub(super) fn arms() -> Vec<&'static str> {
    ARMS.map(|(name, _)| name).to_vec()
}

#[pymethods]
impl Chain {
    #[staticmethod]
    fn builtin(name: &str) -> PyResult<Self> {
        arm::Chain::for_arm(name).map(Self).map_err(wrong)
    }

    #[staticmethod]
    #[pyo3(signature = (table, convention = "modified_dh"))]
    fn from_dh(table: Rows<'_>, convention: &str) -> PyResult<Self> {
        let convention: Convention = convention.parse().map_err(wrong)?;
        let row = |row: &[f64]| DhRow { alpha: row[0], a: row[1], d: row[2], theta_offset: row[3] };
        let numbers = rows(&table, 4, "the table (alpha, a, d, theta_offset)")?;
        let rows: Vec<_> = numbers.rows().into_iter().map(|it| row(&it.to_vec())).collect();
        arm::Chain::new(convention, &rows).map(Self).map_err(wrong)
    }

    #[staticmethod]
    fn from_urdf(text: &str, base_frame: &str, tool_frame: &str) -> PyResult<Self> {
        let described = Description::read(text, base_frame, tool_frame).map_err(wrong)?;
        described.arm.chain().map(Self).map_err(wrong)
    }

    #[getter]
    fn joint_count(&self) -> usize {
        self.0.joint_count()
    }

    fn forward_kinematics(&self, theta: Numbers<'_>) -> PyResult<Pose> {
        self.0.forward_kinematics(&slice(&theta)).map(Pose).map_err(wrong)
    }

    fn link_poses(&self, theta: Numbers<'_>) -> PyResult<Vec<Pose>> {
        let poses = self.0.link_poses(&slice(&theta)).map_err(wrong)?;
        Ok(poses.into_iter().map(Pose).collect())
    }

    fn jacobian<'py>(&self, py: Python<'py>, theta: Numbers<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let columns: Vec<_> = self.evaluated(&slice(&theta))?.tool_columns().collect();
        matrix(py, &Matrix6xX::from_columns(&columns))
    }

    fn body_jacobian<'py>(
        &self,
        py: Python<'py>,
        theta: Numbers<'py>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix(py, &self.evaluated(&slice(&theta))?.body_jacobian())
    }

    fn pose_jacobian<'py>(
        &self,
        py: Python<'py>,
        theta: Numbers<'py>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix(py, &self.evaluated(&slice(&theta))?.pose_jacobian())
    }

    fn twist<'py>(
        &self,
        py: Python<'py>,
        theta: Numbers<'py>,
        theta_dot: Numbers<'py>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let theta_dot = slice(&theta_dot);
        if theta_dot.len() != self.0.joint_count() {
            let expected = self.0.joint_count();
            return Err(wrong(format!("theta_dot has {} numbers, expected {expected}", theta_dot.len())));
        }
        let (angular, linear) = self.evaluated(&slice(&theta))?.tool_twist(&theta_dot);
        Ok(array(py, &[angular.x, angular.y, angular.z, linear.x, linear.y, linear.z]))
    }

    fn forward_kinematics_batch<'py>(
        &self,
        py: Python<'py>,
        thetas: Rows<'py>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let thetas = rows(&thetas, self.0.joint_count(), "thetas")?;
        let poses = |numbers: &mut Vec<f64>, state: &ArmState| {
            numbers.extend_from_slice(state.base_from_tool().to_vector8().as_slice());
        };
        table(py, self.each(py, thetas, 8, poses)?, 8)
    }

    fn jacobian_batch<'py>(&self, py: Python<'py>, thetas: Rows<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let joints = self.0.joint_count();
        let thetas = rows(&thetas, joints, "thetas")?;
        let shape = (thetas.nrows(), 6, joints);
        let jacobian = |numbers: &mut Vec<f64>, state: &ArmState| {
            let start = numbers.len();
            numbers.resize(start + 6 * joints, 0.0);
            for (joint, column) in state.tool_columns().enumerate() {
                let column: Vector6<f64> = column;
                (0..6).for_each(|row| numbers[start + row * joints + joint] = column[row]);
            }
        };
        let numbers = self.each(py, thetas, 6 * joints, jacobian)?;
        Ok(Array3::from_shape_vec(shape, numbers).map_err(wrong)?.into_pyarray(py))
    }

    fn __repr__(&self) -> String {
        format!("<dq_servo.Chain of {} joints>", self.0.joint_count())
    }
}

impl Chain {
    fn evaluated(&self, theta: &[f64]) -> PyResult<ArmState> {
        let mut state = ArmState::new(&self.0);
        self.0.evaluate(theta, &mut state).map_err(wrong)?;
        Ok(state)
    }

    /// Returns the numbers of a table, row by row, with one row per configuration in `thetas`. `add` appends the `width` numbers of a
    /// row.
    fn each(
        &self,
        py: Python<'_>,
        thetas: ArrayView2<'_, f64>,
        width: usize,
        add: impl Fn(&mut Vec<f64>, &ArmState) + Sync,
    ) -> PyResult<Vec<f64>> {
        py.detach(|| {
            let mut numbers = Vec::with_capacity(width * thetas.nrows());
            let (mut state, mut theta) = (ArmState::new(&self.0), vec![0.0; thetas.ncols()]);
            for row in thetas.rows() {
                theta.iter_mut().zip(row).for_each(|(slot, number)| *slot = *number);
                self.0.evaluate(&theta, &mut state)?;
                add(&mut numbers, &state);
            }
            Ok(numbers)
        })
        .map_err(|why: arm::ArmError| wrong(why))
    }
}
