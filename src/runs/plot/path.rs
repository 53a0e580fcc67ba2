//! The path of the controlled point through space.

use super::curve_styles::{CurveStyle, StyledRun, each_once};
use super::outline::outline;
use crate::{RecordedRun, Sample};
use dq_algebra::UnitDualQuaternion;
use dq_figures::{BOTH_SIDES, Figure, LIMIT, Line, Path, Place, Scene, frameplotter, scenes};
use dq_messages::PoseNumbers;
use dq_space::space::KeepOut;
use nalgebra::{Isometry3, Vector3};

/// Returns the poses along the path at which the figure draws small coordinate frames. The more motions the run has, the farther
/// apart these poses are.
fn frames(run: &RecordedRun) -> Vec<Isometry3<f64>> {
    /// The smallest difference between two drawn frames of a run with one motion: a distance \[m\] or an angle \[rad\].
    const APART: (f64, f64) = (0.02, 0.2);
    let mut drawn: Option<UnitDualQuaternion> = None;
    let is_apart = |sample: &&Sample| {
        let apart = drawn.is_none_or(|last| {
            let [distance, angle] = sample.pose.distances(&last);
            distance / APART.0 + angle / APART.1 > run.motions.len().max(1) as f64
        });
        if apart {
            drawn = Some(sample.pose);
        }
        apart
    };
    run.samples.iter().filter(is_apart).map(|sample| frameplotter(&sample.pose.half_log())).collect()
}

/// Returns the start, the goals of the motions, and the end as named points. If there are many goals, the goals have no names.
fn places(run: &RecordedRun) -> Vec<Place> {
    /// The largest number of goals that are named.
    const NAMED: usize = 9;
    let goals: Vec<_> = run.motions.iter().filter_map(|motion| motion.goal).collect();
    let goal = |(number, [x, y, z, ..]): (usize, &PoseNumbers)| {
        let name = if goals.len() == 1 { "goal".to_owned() } else { format!("goal {}", number + 1) };
        let name = if goals.len() > NAMED { String::new() } else { name };
        Place { name, point: Vector3::new(*x, *y, *z) }
    };
    let place =
        |name: &str, sample: &Sample| Place { name: name.to_owned(), point: sample.pose.translation() };
    let start = run.samples.first().map(|sample| place("start", sample));
    let end = run.samples.last().map(|sample| place("end", sample));
    start.into_iter().chain(goals.iter().enumerate().map(goal)).chain(end).collect()
}

/// Returns the outlines of the keep-outs and keep-ins of all runs. Parts far away from the paths `ways` are left out.
fn solids(runs: &[StyledRun], ways: &[Path]) -> Vec<Path> {
    let points: Vec<_> = ways.iter().flat_map(|way| &way.points).copied().collect();
    let outlines = |name: &str, line: Line, of: fn(&RecordedRun) -> &Vec<KeepOut>| {
        let known = each_once(runs.iter().flat_map(|drawn| of(drawn.run)));
        let lines = known.into_iter().flat_map(|solid| outline(&solid.shape, &points));
        lines.map(|points| Path { name: name.to_owned(), color: LIMIT, line, points }).collect::<Vec<_>>()
    };
    let keep_outs = outlines("keep-outs", Line::Solid, |run| &run.keep_outs);
    [keep_outs, outlines("keep-ins", Line::Dashed, |run| &run.keep_ins)].concat()
}

pub(super) fn tool_path(runs: &[StyledRun]) -> Figure {
    let path = |style: &CurveStyle, way: &[Sample]| Path {
        name: style.name.clone(),
        color: style.color,
        line: Line::Solid,
        points: way.iter().map(|sample| sample.pose.translation()).collect(),
    };
    let paths = |(style, samples): (&CurveStyle, &[Sample])| {
        samples.chunk_by(|_, next| !next.jumped).map(|way| path(style, way)).collect::<Vec<_>>()
    };
    // Goals from before the first motion are left out. A run with a stream of goals gets a path through its goals.
    let moved = |drawn: &StyledRun| {
        drawn.run.goals.iter().filter(|(time, _)| *time >= 0.0).map(|(_, goal)| *goal).collect::<Vec<_>>()
    };
    let streams = |drawn: &&StyledRun| (1..moved(drawn).len()).contains(&drawn.run.motions.len());
    let goals = |drawn: &StyledRun| Path {
        name: format!("{}, goals", drawn.run.name),
        color: if runs.len() > 1 { drawn.color() } else { LIMIT },
        line: Line::Dashed,
        points: moved(drawn).iter().map(|goal| goal.translation()).collect(),
    };
    let frames = if let [drawn] = runs { frames(drawn.run) } else { Vec::new() };
    let places: Vec<_> = runs.iter().flat_map(|drawn| places(drawn.run)).collect();
    let ways: Vec<_> = runs
        .iter()
        .filter(streams)
        .map(goals)
        .chain(runs.iter().flat_map(|drawn| drawn.samples().flat_map(paths)))
        .collect();
    let ways = [solids(runs, &ways), ways].concat();
    let scene = |viewpoint| Scene {
        title: String::new(),
        paths: ways.clone(),
        frames: frames.clone(),
        axis_length: 0.06,
        places: places.clone(),
        viewpoint,
    };
    scenes("path", "Path of the controlled point", &[BOTH_SIDES.map(scene).to_vec()])
}
