//! The figures of the paper.

mod errors;
mod paths;
mod runs;

pub use runs::Runs;

use super::{Laboratory, PaperError};
use dq_figures::Figure;

/// Draws all figures, in order.
///
/// # Errors
/// [`PaperError`] if a simulation fails.
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
