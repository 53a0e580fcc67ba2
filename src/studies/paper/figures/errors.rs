//! Figures 1 to 4: errors and joint angles over time.

use super::runs::Runs;
use crate::paper::simulation::follow;
use crate::paper::{Laboratory, PaperError, SimulatedRun, Trajectory};
use dq_algebra::UnitDualQuaternion;
use dq_core::servo::Arms;
use dq_figures::{Axis, COMPONENTS, Figure, Line, Panel, Series, chart, over_time};
use dq_kinematics::control::{Aim, Controller, Map};
use nalgebra::Vector6;

/// The upper ends of the vertical axes of the paper's error plots in figures 1, 3 and 4. The lower ends are the negatives of these
/// numbers.
const CLOSE_UP: [f64; 3] = [0.09, 6.5e-4, 1e-3];

/// The length of the initial part of diffc's motion, which has its own time axis \[s\].
const SOON: f64 = 0.5;

/// The names of the joints in the paper.
const JOINTS: [&str; 8] = ["θ1", "θ2", "θ3", "θ4", "θ5", "θ6", "θ7", "θ8"];

/// Creates a panel whose time axis spans its curves.
fn panel(title: &str, label: &str, series: Vec<Series>) -> Panel {
    let end = series.iter().flat_map(|series| series.points.last()).map(|point| point.0).fold(0.0, f64::max);
    over_time(title, Axis::new("time [s]", 0.0..end), label, series)
}

/// Returns two panels of the same curves: the whole range, and the range that the paper shows.
fn with_close_up(label: &str, series: Vec<Series>, close_up: f64) -> [Panel; 2] {
    let mut close = panel("close up, as in the paper", label, series.clone());
    close.y.range = -close_up..close_up;
    [panel("whole range", label, series), close]
}

/// Returns a copy of `panel` that shows only the first [`SOON`] seconds.
fn soon(panel: &Panel) -> Panel {
    let mut soon = panel.clone();
    soon.title = format!("the first {SOON} s");
    soon.x.range = 0.0..SOON.min(panel.x.range.end);
    soon
}

/// Returns a curve for each of `names`. `values(k, i)` is the value of curve number i at `times[k]`. The first `group` curves are
/// solid, each in its own color; the others are dashed, in the same colors.
fn components(
    names: &[&str],
    group: usize,
    times: &[f64],
    values: impl Fn(usize, usize) -> f64,
) -> Vec<Series> {
    let series = |(i, name): (usize, &&str)| Series {
        name: (*name).to_owned(),
        color: COMPONENTS[i % group],
        line: if i < group { Line::Solid } else { Line::Dashed },
        points: times.iter().enumerate().map(|(k, time)| (*time, values(k, i))).collect(),
    };
    names.iter().enumerate().map(series).collect()
}

/// Returns the curves of the positions of `count` joints. The first joint has the index `first`.
fn angles(trajectory: &Trajectory, first: usize, count: usize) -> Vec<Series> {
    let names = &JOINTS[..count.min(JOINTS.len())];
    components(names, COMPONENTS.len(), &trajectory.times, |k, i| trajectory.states[k][first + i])
}

pub(super) fn error_in_r8(lab: &Laboratory, run: &SimulatedRun) -> Figure {
    const NAMES: [&str; 8] =
        ["real w", "real x", "real y", "real z", "dual w [m]", "dual x [m]", "dual y [m]", "dual z [m]"];
    let goal = run.goal.to_vector8();
    let errors: Vec<_> = run.poses.iter().map(|pose| goal - pose.to_vector8()).collect();
    let series = components(&NAMES, 4, &run.trajectory.times, |k, i| errors[k][i]);
    let title = format!("Figure 1: error of diffc in R⁸, K = {}", lab.experiment.diffc.gain);
    let [whole, close] = with_close_up("error q_d − q", series, CLOSE_UP[0]);
    chart("fig1", &title, &[vec![soon(&whole)], vec![close]])
}

pub(super) fn joint_angles(lab: &Laboratory, run: &SimulatedRun) -> Figure {
    let series = angles(&run.trajectory, 0, lab.chain.joint_count());
    let title = format!("Figure 2: joint angles under diffc, K = {}", lab.experiment.diffc.gain);
    let whole = panel("as in the paper", "angle [rad]", series);
    chart("fig2", &title, &[vec![soon(&whole)], vec![whole]])
}

/// Draws figure 3, and a figure of the joint angles of both manipulators. Section 4 of the paper announces the joint angles but
/// does not show them.
pub(super) fn relative_position(lab: &Laboratory) -> Result<[Figure; 2], PaperError> {
    let constants = lab.experiment.relative_position;
    let mut arms = Arms::two(lab.chain.clone(), lab.chain.clone());
    // The left arm, β, is at theta_desired; the right arm, α, at theta_initial.
    let start = [lab.experiment.theta_desired.as_slice(), &lab.experiment.theta_initial].concat();
    arms.evaluate(&start);
    let target = constants.target_factor * arms.pose().translation();
    let goal = UnitDualQuaternion::from_parts(arms.pose().rotation(), target);
    let damping = lab.settings.controller.damping;
    let law = Controller::of_two_arms(Map::Transpose, Aim::Position, constants.gain, damping);
    let run = follow(arms.clone(), &law, &goal, &start, constants.duration)?;
    let errors: Vec<_> = run.poses(arms).iter().map(|pose| target - pose.translation()).collect();
    let series = components(&["x", "y", "z"], 3, &run.times, |k, i| errors[k][i]);
    let title = format!("Figure 3: relative position control of two arms, K = {}", constants.gain);
    let rows = with_close_up("error [m]", series, CLOSE_UP[1]).map(|panel| vec![panel]);
    let mut figure = chart("fig3", &title, &rows);
    figure.data["theta_beta_alpha_at_end_rad"] = serde_json::json!(run.states.last());
    let count = lab.chain.joint_count();
    let arm = |title, first| panel(title, "angle [rad]", angles(&run, first, count));
    let arms = [vec![
        arm("β: the arm that begins at θ_desired", 0),
        arm("α: the arm that begins at θ_initial", count),
    ]];
    let title = format!("Section 4: the angles of both arms, K = {}", constants.gain);
    Ok([figure, chart("fig3_angles", &title, &arms)])
}

/// Draws two motions of logc: the motion in task space, which the paper shows, and the motion of the simulated arm.
pub(super) fn logc_error(lab: &Laboratory, runs: &Runs) -> Figure {
    const NAMES: [&str; 6] = [
        "½ rotation x [rad]",
        "½ rotation y [rad]",
        "½ rotation z [rad]",
        "½ translation x [m]",
        "½ translation y [m]",
        "½ translation z [m]",
    ];
    let (theirs, ours) = (&runs.task_space_logc, &runs.logc_long);
    let of = |times: &[f64], half_logs: &[Vector6<f64>]| {
        let series = components(&NAMES, 3, times, |k, i| half_logs[k][i]);
        with_close_up("half-log pair of the error", series, CLOSE_UP[2])
    };
    let [mut whole, close] = of(&theirs.times, &theirs.half_logs);
    let gains = lab.experiment.task_space_logc;
    whole.title =
        format!("as the paper: in task space, kω = {}, kv = {}", gains.gain_angular, gains.gain_linear);
    let half_logs: Vec<_> = ours.poses.iter().map(|pose| (ours.goal.inverse() * *pose).half_log()).collect();
    let [mut our_whole, our_close] = of(&ours.trajectory.times, &half_logs);
    our_whole.title = format!("through the joints, k = {}", lab.experiment.comparison.gain);
    // Both panels have the same range, so that they can be compared.
    our_whole.y.range =
        whole.y.range.start.min(our_whole.y.range.start)..whole.y.range.end.max(our_whole.y.range.end);
    whole.y.range = our_whole.y.range.clone();
    let rows = [vec![whole, our_whole], vec![close, our_close]];
    chart("fig4", "Figure 4: error of logc", &rows)
}
