//! Laws that are Python functions or objects.

use super::arrays::{Numbers, array, exactly, wrong};
use super::pose::Pose;
use dq_algebra::UnitDualQuaternion;
use dq_kinematics::control::{AngularLinear, ControlLaw, MEMORY, Map, PoseError, ToolMotion, six_numbers};
use nalgebra::{UnitQuaternion, Vector3};
use numpy::PyArrayMethods;
use pyo3::exceptions::PyTypeError;
use pyo3::intern;
use pyo3::prelude::*;
use std::sync::{Mutex, PoisonError};

/// A law that is a Python function, or a Python object with the method `twist` (see [`OwnLaw::remembering`]).
///
/// A function takes the pose of the goal relative to the tool. It returns the twist `(ω, v)` that moves the tool to the goal at
/// gain 1. Pose and twist are along the base's axes.
///
/// A controller refers to laws by `'static` references. So an `OwnLaw` (some 100 bytes) is never freed. But [`Owned`] frees the
/// Python object in it.
pub(super) struct OwnLaw {
    /// The function or object; `None` after [`Owned`] has freed it.
    law: Mutex<Option<Py<PyAny>>>,
    /// The number of values in the law's memory, if the law is an object; `None` if it is a function.
    memory: Option<usize>,
    map: Map,
    /// The first exception that the Python law raised since the last call of [`check`](Self::check), which returns and removes it.
    raised: Mutex<Option<PyErr>>,
}

impl OwnLaw {
    /// Creates a law from a Python function, or from a Python object with the method `twist`.
    pub fn new(law: &Bound<'_, PyAny>, map: Map) -> PyResult<Self> {
        let memory = match law.hasattr("twist")? {
            true => Some(law.getattr("memory").map_or(Ok(0), |size| size.extract())?),
            false if law.is_callable() => None,
            false => {
                let expected = "a law is one of laws(), a function of the goal's pose, or an object with the method twist";
                return Err(PyTypeError::new_err(expected));
            }
        };
        if let Some(size) = memory.filter(|size| *size > MEMORY) {
            return Err(wrong(format!("the law's memory has {size} numbers, expected at most {MEMORY}")));
        }
        let law = Mutex::new(Some(law.clone().unbind()));
        Ok(Self { law, memory, map, raised: Mutex::default() })
    }

    /// Returns the function or object.
    pub fn object(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let law = self.law.lock().unwrap_or_else(PoisonError::into_inner);
        law.as_ref().map(|law| law.clone_ref(py)).ok_or_else(|| wrong("the law has been freed"))
    }

    fn twist(&self, py: Python<'_>, error: &PoseError) -> PyResult<[f64; 6]> {
        match self.memory {
            None => exactly(&self.object(py)?.call1(py, (pose(error),))?.extract(py)?, "the law's twist"),
            Some(size) => self.remembering(py, (error, [0.0; 6], 0.0), &mut vec![0.0; size]),
        }
    }

    /// Calls the object's method `twist(goal, body_twist, dt, memory)`. `goal` is the goal relative to the tool, and `body_twist`
    /// is the twist that the last command gives the tool, both along the tool's axes. `dt` is the time since the previous cycle
    /// \[s\]. The method may write to the array `memory`.
    fn remembering(
        &self,
        py: Python<'_>,
        (error, body_twist, dt): (&PoseError, [f64; 6], f64),
        memory: &mut [f64],
    ) -> PyResult<[f64; 6]> {
        let remembered = array(py, memory);
        let arguments = (pose(error), array(py, &body_twist), dt, &remembered);
        let law = self.object(py)?;
        let twist: Numbers<'_> = law.call_method1(py, intern!(py, "twist"), arguments)?.extract(py)?;
        memory.copy_from_slice(remembered.try_readonly().map_err(wrong)?.as_slice().map_err(wrong)?);
        exactly(&twist, "the law's twist")
    }

    /// Calls `twist`, and returns its result. If Python raises an exception, stores the exception for [`check`](Self::check), and returns
    /// NaN, so that no arm moves.
    fn kept(&self, twist: impl FnOnce(Python<'_>) -> PyResult<[f64; 6]>) -> AngularLinear {
        let [a, b, c, x, y, z] = Python::attach(twist).unwrap_or_else(|why| {
            self.raised.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(why);
            [f64::NAN; 6]
        });
        (Vector3::new(a, b, c), Vector3::new(x, y, z))
    }

    /// Returns an error if the law has raised a Python exception since the last check. The error is the first such exception.
    pub fn check(&self) -> PyResult<()> {
        let raised = self.raised.lock().unwrap_or_else(PoisonError::into_inner).take();
        raised.map_or(Ok(()), Err)
    }
}

/// Owns a law that was written in Python. When this value is dropped, it frees the Python object.
pub(super) struct Owned(&'static OwnLaw);

impl Owned {
    pub fn new(law: OwnLaw) -> Self {
        Self(Box::leak(Box::new(law)))
    }

    /// Returns the `'static` reference to the law, which controllers store.
    pub fn law(&self) -> &'static OwnLaw {
        self.0
    }
}

impl Drop for Owned {
    fn drop(&mut self) {
        let law = self.0.law.lock().unwrap_or_else(PoisonError::into_inner).take();
        // The lock is released here. Freeing the object may run Python code that takes the lock.
        drop(law);
    }
}

impl ControlLaw for OwnLaw {
    fn name(&self) -> &'static str {
        "own"
    }

    fn map(&self) -> Map {
        self.map
    }

    fn error(&self, error: &PoseError) -> AngularLinear {
        self.kept(|py| self.twist(py, error))
    }

    fn memory_size(&self) -> usize {
        self.memory.unwrap_or_default()
    }

    /// Calls the object's method `begin(body_twist, memory)`, if it has one. Otherwise the memory begins with zeros.
    fn begin(&self, motion: &ToolMotion, memory: &mut [f64]) {
        memory.fill(0.0);
        self.kept(|py| {
            let law = self.object(py)?;
            if law.bind(py).hasattr(intern!(py, "begin"))? {
                let remembered = array(py, memory);
                let arguments = (array(py, &six_numbers(&motion.twist)), &remembered);
                law.call_method1(py, intern!(py, "begin"), arguments)?;
                memory.copy_from_slice(remembered.try_readonly().map_err(wrong)?.as_slice().map_err(wrong)?);
            }
            Ok([0.0; 6])
        });
    }

    fn twist_with_memory(&self, motion: &ToolMotion, memory: &mut [f64]) -> AngularLinear {
        let ToolMotion { gains: [k_omega, k_v], error, twist, period } = motion;
        let (angular, linear) =
            self.kept(|py| self.remembering(py, (error, six_numbers(twist), *period), memory));
        (*k_omega * angular, *k_v * linear)
    }
}

/// Returns the goal relative to the tool.
fn pose(error: &PoseError) -> Pose {
    let rotation = UnitQuaternion::new_unchecked(error.rotation);
    Pose(UnitDualQuaternion::from_parts(rotation, error.translation))
}
