//! Chains, with the kinematics and Jacobians of one or many configurations.

use super::arrays::{Numbers, Rows, array, matrix, rows, slice, table, wrong};
use super::pose::Pose;
use dq_config::{ARMS, ForArm};
use dq_description::Description;
use dq_kinematics::arm::{self, ArmState, Convention, DhRow};
use dq_kinematics::control::six_numbers;
use nalgebra::{Matrix6xX, Vector6};
use numpy::ndarray::{Array3, ArrayView2};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArray3};
use pyo3::prelude::*;
use pyo3::types::PyTuple;

/// A serial arm of revolute and prismatic joints.
#[pyclass(frozen, module = "dq_servo")]
pub(super) struct Chain {
    pub chain: arm::Chain,
    /// The static method that created the chain, such as `from_dh`, and its arguments. Pickling stores both.
    made: (&'static str, Py<PyTuple>),
}

/// Returns the names of the built-in arms.
#[pyfunction]
pub(super) fn arms() -> Vec<&'static str> {
    ARMS.map(|(name, _)| name).to_vec()
}

#[pymethods]
impl Chain {
    /// Returns the chain of the built-in arm `name`, one of `arms()`.
    #[staticmethod]
    fn builtin(py: Python<'_>, name: &str) -> PyResult<Self> {
        Self::made(arm::Chain::for_arm(name).map_err(wrong)?, "builtin", (name,).into_pyobject(py)?)
    }

    /// Creates a chain from rows (alpha [rad], a [m], d [m], theta_offset [rad]) of revolute joints, base first.
    #[staticmethod]
    #[pyo3(signature = (table, convention = "modified_dh"))]
    fn from_dh(py: Python<'_>, table: Rows<'_>, convention: &str) -> PyResult<Self> {
        let name = convention;
        let convention: Convention = convention.parse().map_err(wrong)?;
        let row = |row: &[f64]| DhRow { alpha: row[0], a: row[1], d: row[2], theta_offset: row[3] };
        let numbers = rows(&table, 4, "the table (alpha, a, d, theta_offset)")?;
        let rows: Vec<_> = numbers.rows().into_iter().map(|it| row(&it.to_vec())).collect();
        let chain = arm::Chain::new(convention, &rows).map_err(wrong)?;
        Self::made(chain, "from_dh", (numbers.to_owned().into_pyarray(py), name).into_pyobject(py)?)
    }

    /// Creates a chain from the part of a robot description between two links.
    #[staticmethod]
    fn from_urdf(py: Python<'_>, text: &str, base_frame: &str, tool_frame: &str) -> PyResult<Self> {
        let described = Description::read(text, base_frame, tool_frame).map_err(wrong)?;
        let chain = described.arm.chain().map_err(wrong)?;
        Self::made(chain, "from_urdf", (text, base_frame, tool_frame).into_pyobject(py)?)
    }

    /// Pickles the static method that made the chain, and its arguments.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Py<PyTuple>)> {
        let (method, arguments) = &slf.get().made;
        Ok((slf.get_type().getattr(*method)?, arguments.clone_ref(slf.py())))
    }

    /// The number of joints.
    #[getter]
    fn joint_count(&self) -> usize {
        self.chain.joint_count()
    }

    /// Returns the tool pose in the base frame (eq. 14) at joint positions `theta` [rad, prismatic: m].
    fn forward_kinematics(&self, theta: Numbers<'_>) -> PyResult<Pose> {
        self.chain.forward_kinematics(&slice(&theta)).map(Pose).map_err(wrong)
    }

    /// Returns the pose of each link's frame in the base frame. The frame moves with the link, and its z axis is the joint's axis.
    fn link_poses(&self, theta: Numbers<'_>) -> PyResult<Vec<Pose>> {
        let poses = self.chain.link_poses(&slice(&theta)).map_err(wrong)?;
        Ok(poses.into_iter().map(Pose).collect())
    }

    /// Returns the 6×n Jacobian of the twist (angular, linear) of the tool point, along the base's axes.
    fn jacobian<'py>(&self, py: Python<'py>, theta: Numbers<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let columns: Vec<_> = self.evaluated(&slice(&theta))?.tool_columns().collect();
        matrix(py, &Matrix6xX::from_columns(&columns))
    }

    /// Returns the 6×n Jacobian of the tool's twist (angular, linear) in the tool frame.
    fn body_jacobian<'py>(
        &self,
        py: Python<'py>,
        theta: Numbers<'py>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix(py, &self.evaluated(&slice(&theta))?.body_jacobian())
    }

    /// Returns the 8×n Jacobian of the pose's dual quaternion (eq. 16–20).
    fn pose_jacobian<'py>(
        &self,
        py: Python<'py>,
        theta: Numbers<'py>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix(py, &self.evaluated(&slice(&theta))?.pose_jacobian())
    }

    /// Returns `jacobian(theta) @ theta_dot` without computing the matrix.
    fn twist<'py>(
        &self,
        py: Python<'py>,
        theta: Numbers<'py>,
        theta_dot: Numbers<'py>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let theta_dot = slice(&theta_dot);
        if theta_dot.len() != self.chain.joint_count() {
            let expected = self.chain.joint_count();
            return Err(wrong(format!("theta_dot has {} numbers, expected {expected}", theta_dot.len())));
        }
        Ok(array(py, &six_numbers(&self.evaluated(&slice(&theta))?.tool_twist(&theta_dot))))
    }

    /// Returns the tool poses at N×n joint positions, as N×8 dual quaternions.
    fn forward_kinematics_batch<'py>(
        &self,
        py: Python<'py>,
        thetas: Rows<'py>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let thetas = rows(&thetas, self.chain.joint_count(), "thetas")?;
        let poses = |numbers: &mut Vec<f64>, state: &ArmState| {
            numbers.extend_from_slice(state.base_from_tool().to_vector8().as_slice());
        };
        table(py, self.each(py, thetas, 8, poses)?, 8)
    }

    /// Returns the N×6×n Jacobians at N×n joint positions, like `jacobian`.
    fn jacobian_batch<'py>(&self, py: Python<'py>, thetas: Rows<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let joints = self.chain.joint_count();
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
        format!("<dq_servo.Chain of {} joints>", self.chain.joint_count())
    }
}

impl Chain {
    fn made(chain: arm::Chain, method: &'static str, arguments: Bound<'_, PyTuple>) -> PyResult<Self> {
        Ok(Self { chain, made: (method, arguments.unbind()) })
    }

    fn evaluated(&self, theta: &[f64]) -> PyResult<ArmState> {
        let mut state = ArmState::new(&self.chain);
        self.chain.evaluate(theta, &mut state).map_err(wrong)?;
        Ok(state)
    }

    /// Returns the numbers of a table, row by row. The table has one row for each configuration in `thetas`. `add` computes the `width`
    /// numbers of a row and appends them.
    fn each(
        &self,
        py: Python<'_>,
        thetas: ArrayView2<'_, f64>,
        width: usize,
        add: impl Fn(&mut Vec<f64>, &ArmState) + Sync,
    ) -> PyResult<Vec<f64>> {
        py.detach(|| {
            let mut numbers = Vec::with_capacity(width * thetas.nrows());
            let (mut state, mut theta) = (ArmState::new(&self.chain), vec![0.0; thetas.ncols()]);
            for row in thetas.rows() {
                theta.iter_mut().zip(row).for_each(|(slot, number)| *slot = *number);
                self.chain.evaluate(&theta, &mut state)?;
                add(&mut numbers, &state);
            }
            Ok(numbers)
        })
        .map_err(|why: arm::ArmError| wrong(why))
    }
}
