//! Control laws with their gains.

use super::arrays::{Numbers, Rows, array, rows, slice, table, wrong};
use super::chain::Chain;
use super::own_law::{OwnLaw, Owned};
use super::pose::Pose;
use dq_algebra::{DualQuaternion, UnitDualQuaternion, Vector8};
use dq_kinematics::arm::ArmState;
use dq_kinematics::control::Law as ListedLaw;
use dq_kinematics::control::{ControlLaw, Controller, Map, nearer_goal};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use std::sync::Arc;

/// Returns the names of the library's laws.
#[pyfunction]
pub(super) fn laws() -> Vec<&'static str> {
    ListedLaw::names().to_vec()
}

/// A control law with its gains: one of `laws()`, or your own function or object.
///
/// A function takes the pose of the goal relative to the tool. It returns the twist (angular, linear) that moves the tool to the goal at
/// gain 1. Pose and twist are along the base's axes. For example, `Law(lambda goal: goal.screw_log())` is logc.
///
/// A law that remembers values from cycle to cycle is an object: see `OwnLaw` in the stubs.
#[pyclass(frozen, module = "dq_servo", from_py_object)]
#[derive(Clone)]
pub(super) struct Law {
    pub controller: Controller,
    pub own: Option<Arc<Owned>>,
}

/// The arguments of [`Law`]: the law, its gains and its aim; for the user's own law, also the map to joint velocities.
type LawArguments = (Py<PyAny>, Vec<f64>, &'static str, Option<&'static str>);

/// One number for all gains of a law, or one number for each gain.
#[derive(FromPyObject)]
enum Gains {
    One(f64),
    Each(Vec<f64>),
}

#[pymethods]
impl Law {
    #[new]
    #[pyo3(signature = (law, gains = None, *, aim = "pose", map = None))]
    fn new(law: &Bound<'_, PyAny>, gains: Option<Gains>, aim: &str, map: Option<&str>) -> PyResult<Self> {
        let map = map.map(str::parse::<Map>).transpose().map_err(wrong)?;
        let (law, own) = match (law.extract::<String>(), map) {
            (Ok(name), None) => (name.parse::<ListedLaw>().map_err(wrong)?, None),
            (Ok(name), Some(_)) => {
                return Err(wrong(format!("{name} has its own map: map is for your own laws only")));
            }
            (Err(_), map) => {
                let own = Owned::new(OwnLaw::new(law, map.unwrap_or(Map::DampedInverse))?);
                (ListedLaw::unlisted(own.law()), Some(Arc::new(own)))
            }
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

    /// The name of the law. The name of your own law is `own`.
    #[getter]
    fn name(&self) -> &'static str {
        self.controller.law.name()
    }

    /// The gains of the law: one number, or two numbers if the law has two gains.
    #[getter]
    pub(super) fn gains(&self) -> Vec<f64> {
        let law = self.controller.law;
        self.controller.gains(law)[..law.gains().names.len()].to_vec()
    }

    /// Returns joint velocities [rad/s, prismatic: m/s] toward the goal. A goal q and its negative -q are the same pose; the law uses the
    /// nearer one.
    ///
    /// For a law with a memory, these are the velocities at the beginning of a motion. Use `Servo` for its whole motion.
    fn step<'py>(
        &self,
        py: Python<'py>,
        chain: &Chain,
        theta: Numbers<'py>,
        goal: &Pose,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let mut state = ArmState::new(&chain.chain);
        chain.chain.evaluate(&slice(&theta), &mut state).map_err(wrong)?;
        let speeds = PyArray1::zeros(py, chain.chain.joint_count(), false);
        let mut written = speeds.try_readwrite().map_err(wrong)?;
        self.drive(&state, &goal.0, written.as_slice_mut().map_err(wrong)?);
        self.check()?;
        drop(written);
        Ok(speeds)
    }

    /// Returns the N×n joint velocities for N×n joint positions and N×8 goals.
    fn step_batch<'py>(
        &self,
        py: Python<'py>,
        chain: &Chain,
        thetas: Rows<'py>,
        goals: Rows<'py>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let joints = chain.chain.joint_count();
        let (thetas, goals) = (rows(&thetas, joints, "thetas")?, rows(&goals, 8, "goals")?);
        if goals.nrows() != thetas.nrows() {
            return Err(wrong(format!("{} goals for {} configurations", goals.nrows(), thetas.nrows())));
        }
        let numbers = py.detach(|| {
            let mut speeds = vec![0.0; joints * thetas.nrows()];
            let (mut state, mut theta) = (ArmState::new(&chain.chain), vec![0.0; joints]);
            for ((row, goal), speeds) in
                thetas.rows().into_iter().zip(goals.rows()).zip(speeds.chunks_mut(joints))
            {
                theta.iter_mut().zip(row).for_each(|(slot, number)| *slot = *number);
                chain.chain.evaluate(&theta, &mut state).map_err(|why| why.to_string())?;
                let goal = DualQuaternion::from_vector8(&Vector8::from_fn(|i, _| goal[i]));
                let goal = UnitDualQuaternion::try_normalize(&goal).map_err(|why| why.to_string())?;
                self.drive(&state, &goal, speeds);
            }
            Ok(speeds)
        });
        self.check()?;
        table(py, numbers.map_err(|why: String| wrong(why))?, joints)
    }

    /// Returns the twist (angular, linear) that the law demands of the tool, in the tool frame: gain times error. How closely
    /// the tool follows depends on the arm's Jacobian.
    fn twist<'py>(&self, py: Python<'py>, tool_from_goal: &Pose) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let twist = self.controller.body_twist(&tool_from_goal.0.inverse());
        self.check()?;
        Ok(array(py, twist.as_slice()))
    }

    /// Pickles the arguments of the constructor.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, LawArguments)> {
        let (py, Self { controller, own }) = (slf.py(), slf.get());
        let law = match own {
            Some(own) => own.law().object(py)?,
            None => slf.get().name().into_pyobject(py)?.into_any().unbind(),
        };
        let map = own.as_ref().map(|own| own.law().map().name());
        Ok((slf.get_type().getattr("_of")?, (law, slf.get().gains(), controller.aim.name(), map)))
    }

    #[staticmethod]
    fn _of(law: &Bound<'_, PyAny>, gains: Vec<f64>, aim: &str, map: Option<&str>) -> PyResult<Self> {
        Self::new(law, Some(Gains::Each(gains)), aim, map)
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

    /// Returns an error if the user's own law has raised a Python exception since the last check. The error is that exception.
    pub fn check(&self) -> PyResult<()> {
        self.own.as_ref().map_or(Ok(()), |own| own.law().check())
    }
}
