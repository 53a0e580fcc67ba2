//! Study (a): diffc depends on the position of the base frame; logc and double_geodesic do not.

use super::{Laboratory, PaperError, SimulatedRun};
use dq_algebra::UnitDualQuaternion;
use dq_figures::{
    Axis, Figure, Line, Path, Place, Scene, Series, Viewpoint, chart, law_color, over_time, scenes,
};
use dq_kinematics::control::Law;
use nalgebra::{UnitQuaternion, Vector3};
use serde::Serialize;

/// The result of one simulation of this study: the paper's task under one law, with the base shifted.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Shifted {
    /// The name of the law.
    pub law: &'static str,
    /// The gain of the law [1/s].
    pub gain: f64,
    /// The shift of the base along x \[m\].
    pub shift_m: f64,
    /// The largest distance at equal times between the tool of this run and the tool of the run with the first shift \[mm\]. Both
    /// positions are relative to the arm's own base.
    pub deviation_mm: f64,
}

/// Runs each law with each shift. Returns the results and two figures: the paths, and the distance of
/// each path from the path with the first shift.
///
/// # Errors
/// [`PaperError`] if a simulation fails.
pub fn base_shift(lab: &Laboratory) -> Result<(Vec<Shifted>, [Figure; 2]), PaperError> {
    let (mut rows, mut pictures, mut curves) = (Vec::new(), Vec::new(), Vec::new());
    for law in LAWS {
        let runs = lab.experiment.base_shift.distances.iter().map(|shift| shifted(lab, law, *shift));
        let runs = runs.collect::<Result<Vec<_>, _>>()?;
        rows.extend(compare(lab, law, &runs));
        pictures.push(scene(lab, law, &runs));
        curves.push(apart(lab, law, &runs));
    }
    let title = "The same task with the base moved along x";
    Ok((rows, [scenes("base_shift", title, &[pictures]), deviation_chart(lab, curves)]))
}

const LAWS: [Law; 3] = [Law::Diffc, Law::Logc, Law::DoubleGeodesic];

/// Returns a figure of several panels. The first panel shows the beginning of diffc's motion, and then there is a panel for each
/// law. All panels have the same vertical scale.
fn deviation_chart(lab: &Laboratory, curves: Vec<Vec<Series>>) -> Figure {
    /// The ends of the time axes \[s\]: first for the panel of each law, then for the panel with the beginning of diffc's motion.
    const SOON: (f64, f64) = (2.0, 0.05);
    let most = |series: &[Series]| {
        series.iter().flat_map(|series| &series.points).map(|point| point.1).fold(0.0, f64::max)
    };
    let largest = curves.iter().map(|series| most(series)).fold(1e-9, f64::max);
    let panel = |title: String, until: f64, series: &[Series]| {
        let time = Axis::new("time [s]", 0.0..until.min(lab.experiment.base_shift.duration));
        let mut panel = over_time(&title, time, "apart [mm]", series.to_vec());
        panel.y.range = -0.05 * largest..1.05 * largest;
        panel
    };
    let of_law = |(law, series): (&Law, &Vec<Series>)| {
        let most = most(series);
        let most = if most < 0.1 { format!("{most:.0e}") } else { format!("{most:.0}") };
        panel(format!("{law}: {most} mm at most"), SOON.0, series)
    };
    let mut panels: Vec<_> = LAWS.iter().zip(&curves).map(of_law).collect();
    panels.insert(0, panel(format!("{}, the first {} s", LAWS[0], SOON.1), SOON.1, &curves[0]));
    let title = "How far the tool is from where it would be with the base not moved";
    chart("base_shift_deviation", title, &panels.chunks(2).map(<[_]>::to_vec).collect::<Vec<_>>())
}

/// Runs the law with the arm's base shifted by `shift` along x \[m\]. The returned poses are relative to the arm's own base, so that
/// runs with different shifts can be compared.
fn shifted(lab: &Laboratory, law: Law, shift: f64) -> Result<SimulatedRun, PaperError> {
    let place = UnitDualQuaternion::from_parts(UnitQuaternion::identity(), Vector3::new(shift, 0.0, 0.0));
    let chain = lab.chain.clone().standing_at(&place);
    let mut run =
        lab.run_on(&chain, lab.controller(law, lab.gain(law)), lab.experiment.base_shift.duration)?;
    run.poses.iter_mut().for_each(|pose| *pose = place.inverse() * *pose);
    run.goal = place.inverse() * run.goal;
    Ok(run)
}

fn compare(lab: &Laboratory, law: Law, runs: &[SimulatedRun]) -> Vec<Shifted> {
    let row = |(run, shift): (&SimulatedRun, &f64)| Shifted {
        law: law.name(),
        gain: lab.gain(law),
        shift_m: *shift,
        deviation_mm: deviations(run, &runs[0]).fold(0.0, f64::max),
    };
    runs.iter().zip(&lab.experiment.base_shift.distances).map(row).collect()
}

/// Yields the distances between the tools of two runs at equal times \[mm\].
fn deviations(run: &SimulatedRun, other: &SimulatedRun) -> impl Iterator<Item = f64> {
    let pairs = run.poses.iter().zip(&other.poses);
    pairs.map(|(a, b)| 1e3 * (a.translation() - b.translation()).norm())
}

/// Returns a curve for each run except the first: the distance of its tool from the first run's tool.
fn apart(lab: &Laboratory, law: Law, runs: &[SimulatedRun]) -> Vec<Series> {
    let curve = |(i, (run, shift)): (usize, (&SimulatedRun, &f64))| Series {
        name: format!("{law}, base moved by {shift} m"),
        color: law_color(law),
        line: LINES[(i + 1) % 2],
        points: run.trajectory.times.iter().copied().zip(deviations(run, &runs[0])).collect(),
    };
    runs.iter().zip(&lab.experiment.base_shift.distances).enumerate().skip(1).map(curve).collect()
}

/// The line styles of the runs, one for each shift. Further shifts repeat these styles.
const LINES: [Line; 3] = [Line::Solid, Line::Dashed, Line::Dots];

fn scene(lab: &Laboratory, law: Law, runs: &[SimulatedRun]) -> Scene {
    let path = |(i, (run, shift)): (usize, (&SimulatedRun, &f64))| {
        let line = LINES[i % LINES.len()];
        let mut points: Vec<_> = run.poses.iter().map(|pose| pose.translation()).collect();
        if line == Line::Dots {
            points = spaced(points);
        }
        Path { name: format!("{law}, base moved by {shift} m"), color: law_color(law), line, points }
    };
    let first = &runs[0];
    Scene {
        title: law.name().to_owned(),
        paths: runs.iter().zip(&lab.experiment.base_shift.distances).enumerate().map(path).collect(),
        frames: Vec::new(),
        axis_length: 0.0,
        places: vec![
            Place { name: "start".to_owned(), point: first.poses[0].translation() },
            Place { name: "goal".to_owned(), point: first.goal.translation() },
        ],
        viewpoint: Viewpoint { azimuth: -50.0, elevation: 30.0 },
    }
}

/// Returns points of a path that are far enough apart to be drawn as separate dots.
fn spaced(points: Vec<Vector3<f64>>) -> Vec<Vector3<f64>> {
    const APART: f64 = 0.015;
    let mut last: Option<Vector3<f64>> = None;
    let is_apart = |point: &Vector3<f64>| {
        let apart = last.is_none_or(|last| (point - last).norm() > APART);
        last = if apart { Some(*point) } else { last };
        apart
    };
    points.into_iter().filter(is_apart).collect()
}
