//! Bags: their runs as arrays, and the replay.

use super::arrays::{table, wrong};
use dq_bags::Bag;
use dq_config::{ForArm, ServoParameters};
use dq_runs::RecordedRun;
use numpy::{IntoPyArray, PyArray1, PyArray2};
use pyo3::prelude::*;
use serde::Serialize;
use std::path::PathBuf;

/// The run of one servo in a bag. Times [s] count from its first motion.
#[pyclass(frozen, module = "dq_servo")]
pub(super) struct Run(RecordedRun);

/// Converts a value to Python with serde.
pub(super) fn python<'py>(py: Python<'py>, value: &impl Serialize) -> PyResult<Bound<'py, PyAny>> {
    py.import("json")?.call_method1("loads", (serde_json::to_string(value).map_err(wrong)?,))
}

/// The points of a curve: the times, and rows of `width` numbers.
type Curve<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray2<f64>>);

fn curve<'py, 'a>(
    py: Python<'py>,
    points: impl Iterator<Item = (f64, &'a [f64])>,
    width: usize,
) -> PyResult<Curve<'py>> {
    let (mut times, mut numbers) = (Vec::new(), Vec::new());
    for (time, row) in points {
        times.push(time);
        numbers.extend_from_slice(row);
    }
    Ok((times.into_pyarray(py), table(py, numbers, width)?))
}

#[pymethods]
impl Run {
    /// The name of the bag. If the servo has a namespace other than `/`, the namespace follows.
    #[getter]
    fn name(&self) -> &str {
        &self.0.name
    }

    /// The names of the joints.
    #[getter]
    fn joints(&self) -> Vec<String> {
        self.0.joints.clone()
    }

    /// Times [s], and N×n joint positions [rad, prismatic: m].
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Curve<'py>> {
        let points = self.0.samples.iter().map(|sample| (sample.time, sample.positions.as_slice()));
        curve(py, points, self.0.joints.len())
    }

    /// Times [s], and N×n joint velocities [rad/s, prismatic: m/s].
    #[getter]
    fn velocities<'py>(&self, py: Python<'py>) -> PyResult<Curve<'py>> {
        let points = self.0.samples.iter().map(|sample| (sample.time, sample.velocities.as_slice()));
        curve(py, points, self.0.joints.len())
    }

    /// Times [s], and the controlled poses as N×8 dual quaternions.
    #[getter]
    fn poses<'py>(&self, py: Python<'py>) -> PyResult<Curve<'py>> {
        let poses: Vec<_> =
            self.0.samples.iter().map(|sample| (sample.time, sample.pose.to_vector8())).collect();
        curve(py, poses.iter().map(|(time, pose)| (*time, pose.as_slice())), 8)
    }

    /// Times [s], and the N×2 errors that the servo reported: distance [m] and angle [rad] to the goal.
    #[getter]
    fn errors<'py>(&self, py: Python<'py>) -> PyResult<Curve<'py>> {
        let errors: Vec<_> =
            self.0.errors.iter().map(|(time, error)| (*time, [error.position, error.rotation])).collect();
        curve(py, errors.iter().map(|(time, error)| (*time, error.as_slice())), 2)
    }

    /// For each arm the times [s] and the N×n commands: velocities if the bag has them, otherwise positions.
    #[getter]
    fn commands<'py>(&self, py: Python<'py>) -> PyResult<Vec<Curve<'py>>> {
        let each = self.0.commands.iter().map(|arm| {
            let sent = if arm.velocities.is_empty() { &arm.positions } else { &arm.velocities };
            let width = sent.first().map_or(0, |(_, numbers)| numbers.len());
            curve(py, sent.iter().map(|(time, numbers)| (*time, numbers.as_slice())), width)
        });
        each.collect()
    }

    /// The laws, each with the time [s] from which it was in force.
    #[getter]
    fn laws(&self) -> Vec<(f64, String)> {
        self.0.laws.to_vec()
    }

    /// The motions to goals. Each has all metrics of the table of `dq_servo plot`.
    #[getter]
    fn motions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        python(py, &self.0.motions)
    }

    fn __repr__(&self) -> String {
        format!("<dq_servo.Run {}: {} motions>", self.0.name, self.0.motions.len())
    }
}

/// Returns the runs of a bag. Runs without recorded parameters get the parameters of the built-in `arm`.
#[pyfunction]
#[pyo3(signature = (path, arm = "puma560"))]
pub(super) fn recorded(py: Python<'_>, path: PathBuf, arm: &str) -> PyResult<Vec<Run>> {
    let presumed = ServoParameters::for_arm(arm).map_err(wrong)?;
    let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
    let recorded = py.detach(|| dq_runs::recorded(&path, &name, &presumed)).map_err(wrong)?;
    Ok(recorded.runs.into_iter().map(Run).collect())
}

/// Replays the runs of a bag through the servo. Returns for each servo how many commands were compared, and how many of these commands
/// differ from the recorded ones in any bit.
#[pyfunction]
pub(super) fn replay(py: Python<'_>, path: PathBuf) -> PyResult<Bound<'_, PyAny>> {
    let mut bag = py.detach(|| Bag::open(&path)).map_err(wrong)?;
    python(py, &py.detach(|| dq_runs::replay(&mut bag)).map_err(wrong)?)
}
