//! The runs that the figures are of.

use crate::paper::{Laboratory, PaperError, SimulatedRun, TaskSpaceLogc};
use dq_kinematics::control::Law;

/// The runs that several figures and the comparison share.
pub struct Runs {
    /// diffc with the gain that settles.
    pub diffc: SimulatedRun,
    /// diffc with logc's gain.
    pub diffc_low: SimulatedRun,
    /// The same for as long as figure 7 spans.
    pub diffc_low_long: SimulatedRun,
    /// logc as the paper integrated it.
    pub task_space_logc: TaskSpaceLogc,
    /// logc through the joints, with one gain for rotation and translation.
    pub logc: SimulatedRun,
    /// The same for as long as figure 4 spans.
    pub logc_long: SimulatedRun,
    /// double_geodesic with the same gain.
    pub double_geodesic: SimulatedRun,
}

impl Runs {
    /// Simulates all of these runs.
    ///
    /// # Errors
    /// [`PaperError`].
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
