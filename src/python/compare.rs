//! Runs laws in simulated closed loops, on the tasks of `dq_servo compare`.

use super::arrays::{table, wrong};
use super::law::Law;
use super::parameters::{store, values};
use dq_kinematics::control::Controller;
use dq_studies::compare::{self, Arm, ClosedLoop, PLANTS};
use dq_wire::ServoKind;
use numpy::{IntoPyArray, PyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::prelude::*;
use std::path::Path;

/// Returns the arm `name`, a built-in arm or a parameter file, with the additional `parameters`.
fn arm(py: Python<'_>, name: &str, parameters: Option<&Bound<'_, PyDict>>) -> PyResult<Arm> {
    let arm = Arm::named(Path::new(name)).map_err(wrong)?;
    let values = values(parameters)?;
    // Refuses unknown names in `parameters`. A parameter file may have them, because it may be for several nodes.
    store(py, ServoKind::OneArm, Some(name), values.clone())?;
    arm.with(values).map_err(wrong)
}

/// Returns the first `count` tasks of the comparison: the N×n joint positions at their starts, and their N×8 goals as dual quaternions.
///
/// `arm` is one of `arms()`, or a parameter file.
#[pyfunction]
#[pyo3(signature = (arm, count, seed = 1, *, parameters = None))]
pub(super) fn tasks<'py>(
    py: Python<'py>,
    arm: &str,
    count: u32,
    seed: u64,
    parameters: Option<&Bound<'py, PyDict>>,
) -> PyResult<[Bound<'py, PyArray2<f64>>; 2]> {
    let arm = self::arm(py, arm, parameters)?;
    let (mut starts, mut goals) = (Vec::new(), Vec::new());
    for number in 0..count {
        let task = arm.task(seed, number).map_err(wrong)?;
        starts.extend_from_slice(&task.start);
        goals.extend_from_slice(task.base_from_goal.to_vector8().as_slice());
    }
    Ok([table(py, starts, arm.joint_count())?, table(py, goals, 8)?])
}

/// Returns the gain with which the law settles as fast on this arm as logc with a gain of 2 [1/s]: the median settling times are
/// equal. The tasks of this search differ from the tasks of `compare`.
///
/// Raises a ValueError if the law settles in fewer than half of the tasks at every gain.
#[pyfunction]
#[pyo3(signature = (law, arm, *, parameters = None))]
pub(super) fn settling_gain(
    py: Python<'_>,
    law: &Law,
    arm: &str,
    parameters: Option<&Bound<'_, PyDict>>,
) -> PyResult<f64> {
    let arm = self::arm(py, arm, parameters)?;
    let gain = py.detach(|| compare::settling_gain(&arm, law.controller.law));
    law.check()?;
    gain.map_err(wrong)
}

/// Runs a law on the first `count` tasks of an arm. Returns a dict with an array for each metric; missing values are NaN. The item
/// `outcome` of the dict is a list with the outcome of each task.
///
/// `parameters` are additional parameters of the servo, by their ROS names. They change the arm, but not the law or its gains.
#[pyfunction]
#[pyo3(name = "compare", signature = (law, arm, count = 200, *, seed = 1, limits = true, plant = "ideal",
                                       parameters = None))]
pub(super) fn compared<'py>(
    law: &Bound<'py, Law>,
    arm: &str,
    count: u32,
    seed: u64,
    limits: bool,
    plant: &str,
    parameters: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, PyDict>> {
    let (py, law) = (law.py(), law.get());
    let arm = self::arm(py, arm, parameters)?;
    let plant = PLANTS.into_iter().find(|known| known.name == plant).ok_or_else(|| {
        wrong(format!("no plant is called {plant:?}: expected {}", PLANTS.map(|plant| plant.name).join(", ")))
    })?;
    let damping = arm.parameters.settings.controller.damping;
    let controller = Controller { damping, ..law.controller };
    let closed_loop = ClosedLoop { arm: &arm, controller, plant, limits };
    let ended = py.detach(|| {
        let run = |number: u32| closed_loop.run(&arm.task(seed, number)?, number);
        (0..count).into_par_iter().map(run).collect::<Result<Vec<_>, _>>()
    });
    law.check()?;
    let ended = ended.map_err(wrong)?;
    let results = PyDict::new(py);
    let outcomes: Vec<_> = ended.iter().map(|ended| ended.outcome.name()).collect();
    results.set_item("outcome", outcomes)?;
    let settled: Vec<_> =
        ended.iter().map(|ended| ended.figures.settling_time().unwrap_or(f64::NAN)).collect();
    results.set_item("settling_time_s", settled.into_pyarray(py))?;
    let named: Vec<Vec<_>> = ended.iter().map(|ended| ended.figures.named().collect()).collect();
    for (place, (name, _)) in named.first().into_iter().flatten().enumerate() {
        let values: Vec<_> = named.iter().map(|figures| figures[place].1.unwrap_or(f64::NAN)).collect();
        results.set_item(name, values.into_pyarray(py))?;
    }
    Ok(results)
}
