//! The runs that the figures show.

use crate::paper::{Laboratory, PaperError, SimulatedRun, TaskSpaceLogc};
use dq_kinematics::control::Law;

/// The simulated motions that several figures and the comparison share.
pub struct Runs {
    /// The motion of diffc with the gain that it has in the paper's comparison.
    pub diffc: SimulatedRun,
    /// The motion of diffc with logc's gain.
    pub diffc_low: SimulatedRun,
    /// The motion of diffc with logc's gain. It has the duration of figure 7.
    pub diffc_low_long: SimulatedRun,
    /// The motion of logc in task space, where the paper integrates it without an arm.
    pub task_space_logc: TaskSpaceLogc,
    /// The motion of the arm under logc, with one gain for rotation and translation.
    pub logc: SimulatedRun,
    /// The motion of the arm under logc, with the duration of figure 4.
    pub logc_long: SimulatedRun,
    /// The motion of double_geodesic with logc's gain.
    pub double_geodesic: SimulatedRun,
}

impl Runs {
    /// Simulates all motions.
    ///
    /// # Errors
    /// [`PaperError`] if a simulation fails.
    pub fn new(lab: &Laboratory) -> Result<Self, PaperError> {
        let (diffc, equal) = (lab.experiment.diffc, lab.experiment.comparison);
        let of = |law, gain, duration| lab.run(lab.controller(law, gain), duration);
        Ok(Self {
            diffc: of(Law::Diffc, diffc.gain, diffc.duration)?,
            diffc_low: of(Law::Diffc, diffc.low_gain, diffc.duration)?,
            diffc_low_long: of(Law::Diffc, diffc.low_gain, diffc.low_gain_duration)?,
            task_space_logc: TaskSpaceLogc::new(lab)?,
            logc: of(Law::Logc, equal.gain, equal.duration)?,
            logc_long: of(Law::Logc, equal.gain, lab.experiment.task_space_logc.duration)?,
            double_geodesic: of(Law::DoubleGeodesic, equal.gain, equal.duration)?,
        })
    }
}
