//! The figures of the reference work.

mod errors;
mod paths;

use super::{Laboratory, PaperError, SimulatedRun, TaskSpaceLogc};
use dq_figures::Figure;
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

/// All of them, in order.
///
/// # Errors
/// [`PaperError`].
pub fn all(lab: &Laboratory, runs: &Runs) -> Result<Vec<Figure>, PaperError> {
    let [relative_position, angles] = errors::relative_position(lab)?;
    Ok(vec![
        errors::error_in_r8(lab, &runs.diffc),
        errors::joint_angles(lab, &runs.diffc),
        relative_position,
        angles,
        errors::logc_error(lab, runs),
        paths::both_laws(lab, runs),
        paths::diffc_alone(lab, &runs.diffc)?,
        paths::diffc_with_low_gain(lab, &runs.diffc_low_long),
        paths::diffc_frames(lab, &runs.diffc),
        paths::logc_frames(lab, runs),
    ])
}
