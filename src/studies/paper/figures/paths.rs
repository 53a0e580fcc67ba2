//! Figures 5 to 9: paths and frames of the tool.

use super::runs::Runs;
use crate::paper::{INTERVAL, Laboratory, PaperError, SimulatedRun, TaskSpaceLogc};
use dq_algebra::UnitDualQuaternion;
use dq_figures::{BOTH_SIDES, Figure, Line, Path, Place, Scene, Viewpoint, frameplotter, law_color, scenes};
use dq_kinematics::control::Law;

/// The motion of a tool. The time between poses is [`INTERVAL`].
#[derive(Clone, Copy)]
struct Tool<'a> {
    law: Law,
    poses: &'a [UnitDualQuaternion],
    goal: &'a UnitDualQuaternion,
}

impl<'a> From<&'a SimulatedRun> for Tool<'a> {
    fn from(run: &'a SimulatedRun) -> Self {
        Self { law: run.controller.law, poses: &run.poses, goal: &run.goal }
    }
}

impl<'a> From<&'a TaskSpaceLogc> for Tool<'a> {
    fn from(run: &'a TaskSpaceLogc) -> Self {
        Self { law: Law::Logc, poses: &run.poses, goal: &run.goal }
    }
}

/// Returns the number of samples in an interval \[s\].
fn samples(interval: f64) -> usize {
    ((interval / INTERVAL).round() as usize).max(1)
}

/// The time between the dots of a path \[s\].
const DOT_INTERVAL: f64 = 0.05;

/// The time between the frames along a path \[s\].
const FRAME_INTERVAL: f64 = 0.1;
/// The time between the frames along a path that takes long \[s\].
const LONG_FRAME_INTERVAL: f64 = 1.0;

impl Tool<'_> {
    fn line(&self, name: &str, line: Line) -> Path {
        let points = self.poses.iter().map(UnitDualQuaternion::translation).collect();
        Path { name: name.to_owned(), color: law_color(self.law), line, points }
    }

    /// Returns the path as a line, and as dots at equal intervals of time.
    fn dotted(&self, name: &str) -> Vec<Path> {
        let dots = self.poses.iter().step_by(samples(DOT_INTERVAL)).map(UnitDualQuaternion::translation);
        let dots = Path {
            name: String::new(),
            color: law_color(self.law),
            line: Line::Dots,
            points: dots.collect(),
        };
        let name = format!("{name} (a dot each {DOT_INTERVAL} s)");
        vec![self.line(&name, Line::Solid), dots]
    }

    fn start_and_goal(&self) -> Vec<Place> {
        let place = |name: &str, pose: &UnitDualQuaternion| Place {
            name: name.to_owned(),
            point: pose.translation(),
        };
        self.poses
            .first()
            .map(|pose| place("start", pose))
            .into_iter()
            .chain([place("goal", self.goal)])
            .collect()
    }

    /// Returns the tool's frames along its path, at intervals of `interval` \[s\], from two viewpoints.
    fn frames(&self, title: &str, interval: f64) -> Vec<Scene> {
        let step = samples(interval);
        let end = self.poses.last().map_or_else(nalgebra::Vector3::zeros, UnitDualQuaternion::translation);
        // A tool that stands is drawn once.
        let moving = self.poses.iter().rposition(|pose| (end - pose.translation()).norm() > 2e-3);
        let moving = moving.map_or(self.poses.len(), |last| (last + step).min(self.poses.len()));
        let base = UnitDualQuaternion::identity();
        let drawn = self.poses[..moving].iter().step_by(step).chain([self.goal, &base]);
        let frames: Vec<_> = drawn.map(|pose| frameplotter(&pose.half_log())).collect();
        let mut places = self.start_and_goal();
        places.push(Place { name: "base".to_owned(), point: nalgebra::Vector3::zeros() });
        let path =
            self.line(&format!("tool under {}, frames at least {interval} s apart", self.law), Line::Solid);
        let scene = |viewpoint| Scene {
            title: title.to_owned(),
            paths: vec![path.clone()],
            frames: frames.clone(),
            axis_length: 0.09,
            places: places.clone(),
            viewpoint,
        };
        BOTH_SIDES.map(scene).to_vec()
    }

    /// Returns the percentage of the initial distance to the goal that remains at the end.
    fn left_percent(&self) -> f64 {
        let distance = |pose: Option<&UnitDualQuaternion>| {
            pose.map_or(0.0, |pose| (pose.translation() - self.goal.translation()).norm())
        };
        100.0 * distance(self.poses.last()) / distance(self.poses.first())
    }
}

/// The viewpoint from which the whole length of the paths is visible.
const ABOVE: Viewpoint = Viewpoint { azimuth: -50.0, elevation: 30.0 };

/// Creates a scene of paths without frames.
fn plain(title: &str, paths: Vec<Path>, places: Vec<Place>, viewpoint: Viewpoint) -> Scene {
    Scene { title: title.to_owned(), paths, frames: Vec::new(), axis_length: 0.0, places, viewpoint }
}

pub(super) fn both_laws(lab: &Laboratory, runs: &Runs) -> Figure {
    let (gain, one) = (lab.experiment.diffc.gain, lab.experiment.comparison.gain);
    let mut paths = Tool::from(&runs.diffc).dotted(&format!("diffc, K = {gain}"));
    paths.extend(Tool::from(&runs.task_space_logc).dotted("logc as the paper, in task space"));
    paths.push(Tool::from(&runs.logc).line(&format!("logc through the joints, k = {one}"), Line::Dashed));
    let places = Tool::from(&runs.diffc).start_and_goal();
    let scene = |viewpoint| plain("", paths.clone(), places.clone(), viewpoint);
    let beside = Viewpoint { azimuth: -10.0, elevation: 10.0 };
    scenes("fig5", "Figure 5: paths of both laws in R³", &[[ABOVE, beside].map(scene).to_vec()])
}

pub(super) fn diffc_alone(lab: &Laboratory, run: &SimulatedRun) -> Result<Figure, PaperError> {
    // If there is no overshoot, the view extends this far around the goal [m].
    const NEAR: f64 = 5e-3;
    let overshoot = 1e3 * lab.metrics(run)?.figures.overshoot;
    let tool = Tool::from(run);
    let name = format!("diffc, K = {}, {overshoot:.1} mm past the goal at most", lab.experiment.diffc.gain);
    let whole = plain("whole path", tool.dotted(&name), tool.start_and_goal(), ABOVE);
    let mut end = whole.clone();
    end.title = "its end".to_owned();
    end.places.retain(|place| place.name == "goal");
    // The view extends around the goal four times as far as the overshoot.
    let near = (4e-3 * overshoot).max(NEAR);
    for path in &mut end.paths {
        path.points.retain(|point| (point - run.goal.translation()).norm() < near);
    }
    Ok(scenes("fig6", "Figure 6: the path of diffc alone", &[vec![whole, end]]))
}

pub(super) fn diffc_with_low_gain(lab: &Laboratory, run: &SimulatedRun) -> Figure {
    let (tool, diffc) = (Tool::from(run), lab.experiment.diffc);
    let title = format!(
        "Figure 7: diffc, K = {}: {:.0} % of the distance is left after {} s",
        diffc.low_gain,
        tool.left_percent(),
        diffc.low_gain_duration
    );
    scenes("fig7", &title, &[tool.frames("", LONG_FRAME_INTERVAL)])
}

pub(super) fn diffc_frames(lab: &Laboratory, run: &SimulatedRun) -> Figure {
    let title =
        format!("Figure 8: diffc, K = {} (its caption in the paper says logc)", lab.experiment.diffc.gain);
    scenes("fig8", &title, &[Tool::from(run).frames("", FRAME_INTERVAL)])
}

pub(super) fn logc_frames(lab: &Laboratory, runs: &Runs) -> Figure {
    let gains = lab.experiment.task_space_logc;
    let theirs =
        format!("as the paper: in task space, kω = {}, kv = {}", gains.gain_angular, gains.gain_linear);
    let ours = format!("through the joints, k = {}", lab.experiment.comparison.gain);
    let rows = [(Tool::from(&runs.task_space_logc), theirs), (Tool::from(&runs.logc), ours)];
    let rows = rows.map(|(tool, title)| tool.frames(&title, FRAME_INTERVAL));
    scenes("fig9", "Figure 9: logc", &rows)
}
