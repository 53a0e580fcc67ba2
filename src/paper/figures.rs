//! The figures of the reference work.

use super::simulation::{Precision, Span, follow_freely, follow_two, pose, two_arms};
use super::{INTERVAL, Laboratory, PaperError, SimulatedRun};
use crate::control::{Cooperative, Feedback, Law, Primitive, TwistGains, logc_twist};
use crate::dq::UnitDualQuaternion;
use crate::draw::{
    Axis, COMPONENTS, DrawError, Figure, Line, Panel, Path, Place, Scene, Series, chart, frameplotter,
    law_color, range_of, scenes,
};
use nalgebra::Vector6;
use std::ops::Range;

/// What the paper's error plots show of their vertical axes: figures 1, 3 and 4.
const CLOSE_UP: [f64; 3] = [0.09, 6.5e-4, 1e-3];

/// The runs that several figures and the comparison share.
pub struct Runs {
    /// diffc with the gain that settles.
    pub diffc: SimulatedRun,
    /// diffc with logc's gain.
    pub diffc_low: SimulatedRun,
    /// logc with one gain for rotation and translation.
    pub logc: SimulatedRun,
    /// double_geodesic with the same gain.
    pub double_geodesic: SimulatedRun,
    /// logc with the paper's two decay rates.
    pub logc_decay: SimulatedRun,
}

impl Runs {
    /// Simulates them.
    ///
    /// # Errors
    /// [`PaperError`].
    pub fn new(lab: &Laboratory) -> Result<Self, PaperError> {
        let constants = &lab.experiment;
        let of = |law, gain, duration| lab.run(lab.controller(law, gain), duration);
        let equal = |law| of(law, constants.comparison.gain, constants.comparison.duration);
        let mut decay = lab.controller(Law::Logc, 0.0);
        decay.logc = decay_gains(lab);
        Ok(Self {
            diffc: of(Law::Diffc, constants.diffc.gain, constants.diffc.duration)?,
            diffc_low: of(Law::Diffc, constants.diffc.low_gain, constants.diffc.duration)?,
            logc: equal(Law::Logc)?,
            double_geodesic: equal(Law::DoubleGeodesic)?,
            logc_decay: lab.run(decay, constants.logc_decay.duration)?,
        })
    }
}

fn decay_gains(lab: &Laboratory) -> TwistGains {
    let decay = &lab.experiment.logc_decay;
    TwistGains { angular: decay.gain_angular, linear: decay.gain_linear }
}

/// All of them, in order.
///
/// # Errors
/// [`PaperError`].
pub fn all(lab: &Laboratory, runs: &Runs) -> Result<Vec<Figure>, PaperError> {
    let (gain, low) = (lab.experiment.diffc.gain, lab.experiment.diffc.low_gain);
    let one = lab.experiment.comparison.gain;
    Ok(vec![
        error_in_r8(lab, &runs.diffc)?,
        joint_angles(lab, &runs.diffc)?,
        relative_position(lab)?,
        logc_error(lab, &runs.logc_decay)?,
        paths_of_both(lab, runs)?,
        path_of_diffc(lab, &runs.diffc)?,
        frames_along(
            "fig7",
            &format!("Figure 7: diffc with logc's gain, K = {low}, does not arrive"),
            &runs.diffc_low,
        )?,
        frames_along("fig8", &format!("Figure 8: diffc, K = {gain}"), &runs.diffc)?,
        frames_along("fig9", &format!("Figure 9: logc, k = {one}"), &runs.logc)?,
    ])
}

const TIME: &str = "time [s]";

/// A panel of curves over time; the whole range unless `close_up` says how far to look.
fn over_time(title: &str, label: &str, series: Vec<Series>, close_up: Option<f64>) -> Panel {
    let values = || series.iter().flat_map(|series| series.points.iter().map(|point| point.1));
    let end = series.iter().flat_map(|series| series.points.last()).map(|point| point.0).fold(0.0, f64::max);
    let range: Range<f64> = close_up.map_or_else(|| range_of(values()), |value| -value..value);
    Panel {
        title: title.to_owned(),
        x: Axis::new(TIME, 0.0..end),
        y: Axis::new(label, range),
        series,
        ..Panel::default()
    }
}

/// The whole and, below it, the part that the paper shows.
fn with_close_up(label: &str, series: Vec<Series>, close_up: f64) -> Vec<Vec<Panel>> {
    vec![
        vec![over_time("whole range", label, series.clone(), None)],
        vec![over_time("close up, as in the paper", label, series, Some(close_up))],
    ]
}

/// How much of diffc's motion is over so soon that it needs a time axis of its own \[s\].
const SOON: f64 = 0.5;

/// A curve of `values` for each of `names`, four colours solid and then dashed.
fn components(names: &[&str], times: &[f64], values: impl Fn(usize, usize) -> f64) -> Vec<Series> {
    let series = |(i, name): (usize, &&str)| Series {
        name: (*name).to_owned(),
        color: COMPONENTS[i % 4],
        line: if i < 4 { Line::Solid } else { Line::Dashed },
        points: times.iter().enumerate().map(|(k, time)| (*time, values(k, i))).collect(),
    };
    names.iter().enumerate().map(series).collect()
}

fn error_in_r8(lab: &Laboratory, run: &SimulatedRun) -> Result<Figure, DrawError> {
    const NAMES: [&str; 8] =
        ["real w", "real x", "real y", "real z", "dual w [m]", "dual x [m]", "dual y [m]", "dual z [m]"];
    let goal = run.goal.to_vector8();
    let errors: Vec<_> = run.poses.iter().map(|pose| goal - pose.to_vector8()).collect();
    let series = components(&NAMES, &run.trajectory.times, |k, i| errors[k][i]);
    let title = format!("Figure 1: error of diffc in R⁸, K = {}", lab.experiment.diffc.gain);
    let mut rows = with_close_up("error q_d − q", series, CLOSE_UP[0]);
    rows[0][0].title = format!("whole range, the first {SOON} s");
    rows[0][0].x.range = 0.0..SOON;
    chart("fig1", &title, &rows)
}

fn joint_angles(lab: &Laboratory, run: &SimulatedRun) -> Result<Figure, DrawError> {
    const NAMES: [&str; 8] = ["θ1", "θ2", "θ3", "θ4", "θ5", "θ6", "θ7", "θ8"];
    let names = &NAMES[..lab.chain.joint_count().min(NAMES.len())];
    let series = components(names, &run.trajectory.times, |k, i| run.trajectory.states[k][i]);
    let title = format!("Figure 2: joint angles under diffc, K = {}", lab.experiment.diffc.gain);
    chart("fig2", &title, &[vec![over_time("", "angle [rad]", series, None)]])
}

fn relative_position(lab: &Laboratory) -> Result<Figure, PaperError> {
    let constants = lab.experiment.relative_position;
    let chains = (&lab.chain, &lab.chain);
    // β, the left arm, is at theta_desired; α, the right one, at theta_initial.
    let start = [lab.experiment.theta_desired.as_slice(), &lab.experiment.theta_initial].concat();
    let arms = two_arms(chains, &start)?;
    let target = constants.target_factor * arms.tool_point();
    let goal = UnitDualQuaternion::from_parts(arms.base_from_tool().rotation(), target);
    let law = Cooperative {
        primitive: Primitive::RelativePosition,
        feedback: Feedback::Transpose,
        transpose_gain: constants.gain,
        inverse_gain: constants.gain,
        damping: lab.settings.controller.damping,
    };
    let span = Span { duration: constants.duration, interval: 5e-3, precision: Precision::FINE };
    let run = follow_two(chains, &law, &goal, &start, &span)?;
    let errors = run.states.iter().map(|theta| Ok(target - two_arms(chains, theta)?.tool_point()));
    let errors = errors.collect::<Result<Vec<_>, PaperError>>()?;
    let series = components(&["x", "y", "z"], &run.times, |k, i| errors[k][i]);
    let title = format!("Figure 3: relative position control of two arms, K = {}", constants.gain);
    let mut figure = chart("fig3", &title, &with_close_up("error [m]", series, CLOSE_UP[1]))?;
    figure.data["theta_beta_alpha_at_end_rad"] = serde_json::json!(run.states.last());
    Ok(figure)
}

/// In task space, as the paper integrated it, and through the joints, as the program runs it.
fn logc_error(lab: &Laboratory, through_joints: &SimulatedRun) -> Result<Figure, PaperError> {
    let (constants, gains) = (lab.experiment.logc_decay, decay_gains(lab));
    let goal = through_joints.goal;
    let start = lab.chain.forward_kinematics(&lab.experiment.theta_initial)?;
    let span = Span { duration: constants.duration, interval: INTERVAL, precision: Precision::FINE };
    let free = follow_freely(|error| logc_twist(&gains, error), &goal, &start, &span)?;
    let log = |pose: &UnitDualQuaternion| (goal.conjugate() * *pose).screw_log();
    let in_task_space: Vec<_> =
        free.states.iter().filter_map(|numbers| pose(numbers)).map(|q| log(&q)).collect();
    let in_joints: Vec<_> = through_joints.poses.iter().map(log).collect();
    let part = |offset: usize| {
        let curve = |(name, line, times, logs): (&str, Line, &Vec<f64>, &Vec<Vector6<f64>>)| {
            (0..3)
                .map(move |i| Series {
                    name: format!("{}, {name}", ["x", "y", "z"][i]),
                    color: COMPONENTS[i],
                    line,
                    points: times.iter().zip(logs).map(|(time, log)| (*time, log[offset + i])).collect(),
                })
                .collect::<Vec<_>>()
        };
        let free = curve(("task space", Line::Solid, &free.times, &in_task_space));
        let joints = curve(("through joints", Line::Dashed, &through_joints.trajectory.times, &in_joints));
        [free, joints].concat()
    };
    let rows =
        [("whole range", None), ("close up, as in the paper", Some(CLOSE_UP[2]))].map(|(title, close_up)| {
            vec![
                over_time(&format!("rotation, {title}"), "ω [rad]", part(0), close_up),
                over_time(&format!("translation, {title}"), "v [m]", part(3), close_up),
            ]
        });
    let title = format!("Figure 4: error of logc in se(3), kω = {}, kv = {}", gains.angular, gains.linear);
    Ok(chart("fig4", &title, &rows)?)
}

/// How many samples make an interval \[s\].
fn samples(interval: f64) -> usize {
    ((interval / INTERVAL).round() as usize).max(1)
}

/// Seconds between the dots of a path.
const DOT_INTERVAL: f64 = 0.05;

/// The tool's path as a line, and as dots at even times.
fn path(run: &SimulatedRun, name: &str) -> Vec<Path> {
    let color = law_color(run.controller.law);
    let points = |step| run.poses.iter().step_by(step).map(|pose| pose.translation()).collect();
    vec![
        Path { name: name.to_owned(), color, line: Line::Solid, points: points(1) },
        Path { name: String::new(), color, line: Line::Dots, points: points(samples(DOT_INTERVAL)) },
    ]
}

fn start_and_goal(run: &SimulatedRun) -> Vec<Place> {
    let start = run.poses.first().map(|pose| Place { name: "start".to_owned(), point: pose.translation() });
    let goal = Place { name: "goal".to_owned(), point: run.goal.translation() };
    start.into_iter().chain([goal]).collect()
}

fn paths_of_both(lab: &Laboratory, runs: &Runs) -> Result<Figure, DrawError> {
    let (gain, one) = (lab.experiment.diffc.gain, lab.experiment.comparison.gain);
    let mut paths = path(&runs.diffc, &format!("diffc, K = {gain}"));
    paths.extend(path(&runs.logc, &format!("logc, k = {one}")));
    let scene = |view| Scene {
        title: String::new(),
        paths: paths.clone(),
        frames: Vec::new(),
        axis_length: 0.0,
        places: start_and_goal(&runs.diffc),
        view,
    };
    let title = format!("Figure 5: paths of both laws in R³, a dot each {DOT_INTERVAL} s");
    scenes("fig5", &title, &[scene((-50.0, 30.0)), scene((-10.0, 10.0))])
}

fn path_of_diffc(lab: &Laboratory, run: &SimulatedRun) -> Result<Figure, PaperError> {
    let overshoot = lab.metrics(run)?.overshoot_mm;
    let name = format!("diffc, K = {}, overshoots by {overshoot:.1} mm", lab.experiment.diffc.gain);
    let whole = Scene {
        title: "whole path".to_owned(),
        paths: path(run, &name),
        frames: Vec::new(),
        axis_length: 0.0,
        places: start_and_goal(run),
        view: (-50.0, 30.0),
    };
    let mut end = whole.clone();
    end.title = "its end".to_owned();
    end.places.retain(|place| place.name == "goal");
    // Four times as far around the goal as the overshoot.
    let near = 4e-3 * overshoot;
    for path in &mut end.paths {
        path.points.retain(|point| (point - run.goal.translation()).norm() < near);
    }
    Ok(scenes(
        "fig6",
        "Figure 6: the path of diffc alone, which passes its goal and comes back",
        &[whole, end],
    )?)
}

/// Seconds between the frames along a path.
const FRAME_INTERVAL: f64 = 0.1;

/// The tool's frames along its way, seen from two sides.
fn frames_along(name: &str, title: &str, run: &SimulatedRun) -> Result<Figure, DrawError> {
    let step = samples(FRAME_INTERVAL);
    let end = run
        .poses
        .iter()
        .rposition(|pose| (run.poses[run.poses.len() - 1].translation() - pose.translation()).norm() > 2e-3);
    // A tool that stands still is drawn once.
    let moving = end.map_or(run.poses.len(), |end| (end + step).min(run.poses.len()));
    let drawn = |pose: &UnitDualQuaternion| frameplotter(&pose.half_log());
    let mut frames: Vec<_> = run.poses[..moving].iter().step_by(step).map(drawn).collect();
    frames.push(drawn(&run.goal));
    frames.push(drawn(&UnitDualQuaternion::identity()));
    let mut places = start_and_goal(run);
    places.push(Place { name: "base".to_owned(), point: nalgebra::Vector3::zeros() });
    let tool = Path {
        name: format!("tool under {}, a frame each {FRAME_INTERVAL} s", run.controller.law),
        color: law_color(run.controller.law),
        line: Line::Solid,
        points: run.poses.iter().map(|pose| pose.translation()).collect(),
    };
    let scene = |view| Scene {
        title: String::new(),
        paths: vec![tool.clone()],
        frames: frames.clone(),
        axis_length: 0.09,
        places: places.clone(),
        view,
    };
    scenes(name, title, &[scene((-60.0, 20.0)), scene((165.0, 15.0))])
}
