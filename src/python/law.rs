//! Control laws: those of the library by their names, and laws that are Python functions.

use super::arrays::{Numbers, Rows, array, exactly, rows, slice, table, wrong};
use super::chain::Chain;
use super::pose::Pose;
use dq_algebra::{DualQuaternion, UnitDualQuaternion, Vector8};
use dq_kinematics::arm::ArmState;
use dq_kinematics::control::Law as ListedLaw;
use dq_kinematics::control::{AngularLinear, ControlLaw, Controller, Map, PoseError, nearer_goal};
use nalgebra::{UnitQuaternion, Vector3};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use std::sync::{Mutex, PoisonError};

/// Returns the names of the library's laws.
#[pyfunction]
pub(super) fn laws() -> Vec<&'static str> {
    ListedLaw::names().to_vec()
}

/// A law that is a Python function. The function gets the pose of the goal relative to the tool, along the base's axes. It returns
/// the twist `(ω, v)` that moves the tool to the goal at gain 1.
pub(super) struct OwnLaw {
    function: Py<PyAny>,
    map: Map,
    /// The first exception that the function raised, until [`Self::check`] raises it in the caller.
    raised: Mutex<Option<PyErr>>,
}

impl OwnLaw {
    fn twist(&self, py: Python<'_>, error: &PoseError) -> PyResult<[f64; 6]> {
        let rotation = UnitQuaternion::new_unchecked(error.rotation);
        let goal = Pose(UnitDualQuaternion::from_parts(rotation, error.translation));
        let twist: Numbers<'_> = self.function.call1(py, (goal,))?.extract(py)?;
        exactly(&twist, "the law's twist")
    }

    /// Raises the exception that the function raised in a call, if there was one.
    pub fn check(&self) -> PyResult<()> {
        let raised = self.raised.lock().unwrap_or_else(PoisonError::into_inner).take();
        raised.map_or(Ok(()), Err)
    }
}

impl ControlLaw for OwnLaw {
    fn name(&self) -> &'static str {
        "own"
    }

    fn map(&self) -> Map {
        self.map
    }

    /// Returns NaN if the function raises an exception, so that no arm moves.
    fn error(&self, error: &PoseError) -> AngularLinear {
        let twist = Python::attach(|py| self.twist(py, error)).unwrap_or_else(|why| {
            self.raised.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(why);
            [f64::NAN; 6]
        });
        let [a, b, c, x, y, z] = twist;
        (Vector3::new(a, b, c), Vector3::new(x, y, z))
    }
}

/// A law with its gains.
#[pyclass(frozen, module = "dq_servo", from_py_object)]
#[derive(Clone)]
pub(super) struct Law {
    pub controller: Controller,
    pub own: Option<&'static OwnLaw>,
}

/// One number for all gains of a law, or one number for each gain.
#[derive(FromPyObject)]
enum Gains {
    One(f64),
    Each(Vec<f64>),
}

#[pymethods]
impl Law {
    #[new]
    #[pyo3(signature = (law, gains = None, *, aim = "pose", map = "damped_inverse"))]
    fn new(law: &Bound<'_, PyAny>, gains: Option<Gains>, aim: &str, map: &str) -> PyResult<Self> {
        let (law, own) = if let Ok(name) = law.extract::<String>() {
            (name.parse::<ListedLaw>().map_err(wrong)?, None)
        } else if law.is_callable() {
            let raised = Mutex::default();
            let own = OwnLaw { function: law.clone().unbind(), map: map.parse().map_err(wrong)?, raised };
            // The law is never freed, so that nobody can drop a law that is in use. The library's laws are `'static` too.
            let own: &'static OwnLaw = Box::leak(Box::new(own));
            (ListedLaw::unlisted(own), Some(own))
        } else {
            return Err(PyTypeError::new_err("a law is one of laws(), or a function of the goal's pose"));
        };
        let mut controller = Controller { aim: aim.parse().map_err(wrong)?, ..Controller::default() };
        if own.is_some() {
            controller.set_gains(law, [1.0; 2]);
        }
        controller = match gains {
            None => Controller { law, ..controller },
            Some(Gains::One(gain)) => controller.with_law(law, gain),
            Some(Gains::Each(gains)) => {
                let expected = law.gains().names.len();
                let [one, other] = match *gains.as_slice() {
                    [gain] if expected == 1 => [gain, gain],
                    [one, other] if expected == 2 => [one, other],
                    _ => return Err(wrong(format!("{law} has {expected} gains, got {}", gains.len()))),
                };
                controller.with_gains(law, [one, other])
            }
        };
        match controller.gains(law).iter().find(|gain| !(gain.is_finite() && **gain >= 0.0)) {
            Some(gain) => {
                Err(wrong(format!("{law} has the gain {gain}, expected a finite number not below 0")))
            }
            None => Ok(Self { controller, own }),
        }
    }

    #[getter]
    fn name(&self) -> &'static str {
        self.controller.law.name()
    }

    #[getter]
    pub(super) fn gains(&self) -> Vec<f64> {
        let law = self.controller.law;
        self.controller.gains(law)[..law.gains().names.len()].to_vec()
    }

    fn step<'py>(
        &self,
        py: Python<'py>,
        chain: &Chain,
        theta: Numbers<'py>,
        goal: &Pose,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let mut state = ArmState::new(&chain.0);
        chain.0.evaluate(&slice(&theta), &mut state).map_err(wrong)?;
        let speeds = PyArray1::zeros(py, chain.0.joint_count(), false);
        let mut written = speeds.try_readwrite().map_err(wrong)?;
        self.drive(&state, &goal.0, written.as_slice_mut().map_err(wrong)?);
        self.check()?;
        drop(written);
        Ok(speeds)
    }

    fn step_batch<'py>(
        &self,
        py: Python<'py>,
        chain: &Chain,
        thetas: Rows<'py>,
        goals: Rows<'py>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let joints = chain.0.joint_count();
        let (thetas, goals) = (rows(&thetas, joints, "thetas")?, rows(&goals, 8, "goals")?);
        if goals.nrows() != thetas.nrows() {
            return Err(wrong(format!("{} goals for {} configurations", goals.nrows(), thetas.nrows())));
        }
        let numbers = py.detach(|| {
            let mut speeds = vec![0.0; joints * thetas.nrows()];
            let (mut state, mut theta) = (ArmState::new(&chain.0), vec![0.0; joints]);
            for ((row, goal), speeds) in
                thetas.rows().into_iter().zip(goals.rows()).zip(speeds.chunks_mut(joints))
            {
                theta.iter_mut().zip(row).for_each(|(slot, number)| *slot = *number);
                chain.0.evaluate(&theta, &mut state).map_err(|why| why.to_string())?;
                let goal = DualQuaternion::from_vector8(&Vector8::from_fn(|i, _| goal[i]));
                let goal = UnitDualQuaternion::try_normalize(&goal).map_err(|why| why.to_string())?;
                self.drive(&state, &goal, speeds);
            }
            Ok(speeds)
        });
        self.check()?;
        table(py, numbers.map_err(|why: String| wrong(why))?, joints)
    }

    /// Returns gain times error: the twist with which a free tool would move.
    fn twist<'py>(&self, py: Python<'py>, tool_from_goal: &Pose) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let twist = self.controller.body_twist(&tool_from_goal.0.inverse());
        self.check()?;
        Ok(array(py, twist.as_slice()))
    }

    fn __repr__(&self) -> String {
        format!("<dq_servo.Law {}: {}>", self.name(), self.controller.describe_gains())
    }
}

impl Law {
    fn drive(&self, arm: &ArmState, goal: &UnitDualQuaternion, speeds: &mut [f64]) {
        let goal = nearer_goal(goal, &arm.base_from_tool());
        self.controller.joint_velocity(arm, &goal, speeds);
    }

    /// Raises the exception that a Python law raised in a call, if there was one.
    pub fn check(&self) -> PyResult<()> {
        self.own.map_or(Ok(()), OwnLaw::check)
    }
}
