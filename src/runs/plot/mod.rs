//! The figures of recorded runs. Several runs share each figure.

mod charts;
mod curve_styles;
mod outline;
mod path;

use super::RecordedRun;
use curve_styles::styles;
use dq_figures::Figure;

/// Returns all figures of the runs.
pub fn plot(runs: &[RecordedRun]) -> Vec<Figure> {
    let runs = styles(runs);
    let mut figures = Vec::new();
    if runs.iter().any(|drawn| !drawn.run.errors.is_empty()) {
        figures.push(charts::pose_error(&runs));
    }
    figures.push(charts::joint_positions(&runs));
    if runs.iter().any(|drawn| drawn.run.has_speeds()) {
        figures.push(charts::joint_velocities(&runs));
    }
    if runs.iter().any(|drawn| !drawn.run.clearances.is_empty()) {
        figures.push(charts::clearance(&runs));
    }
    figures.extend([path::tool_path(&runs), charts::singular_value(&runs)]);
    if runs.iter().any(|drawn| !drawn.run.jitter.is_empty()) {
        figures.push(charts::cycle_jitter(&runs));
    }
    figures
}
