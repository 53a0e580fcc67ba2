//! The goal, the tool and the path as markers.

use super::trace::Trace;
use dq_core::servo::ClosePair;
use dq_figures::{AXES, Color, law_color};
use dq_kinematics::control::Law;
use dq_messages::messages::{Header, Point, Pose, Vector3};
use dq_messages::visualization::{ColorRGBA, Marker, MarkerArray};
use dq_space::space::Scene;
use dq_wire::point_message;
use nalgebra::{Quaternion, UnitQuaternion};
use std::sync::Arc;

/// The length of the axes of a frame, and the width of their lines \[m\].
#[derive(Clone, Copy)]
struct Axes {
    length: f64,
    width: f64,
}

const GOAL: Axes = Axes { length: 0.12, width: 0.010 };
const TOOL: Axes = Axes { length: 0.09, width: 0.008 };
const ALONG_PATH: Axes = Axes { length: 0.035, width: 0.003 };

/// The width of the path \[m\].
const PATH_WIDTH: f64 = 0.006;

/// The distance between the frames along the path \[m, rad\].
const SPACING: f64 = 0.06;
const TURN_SPACING: f64 = 0.35;

/// The data that one picture shows.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Moment {
    /// The time and the frame of the data.
    pub header: Header,
    /// The pose of the tool.
    pub tool: Option<Pose>,
    /// The pose of the goal.
    pub goal: Option<Pose>,
    /// The number of goals up to this time.
    pub motion: u64,
    /// The name of the law.
    pub law: &'static str,
    /// The scene, whose keep-outs and keep-ins are drawn.
    pub scene: Option<Arc<Scene>>,
    /// The two parts that are closest to each other: parts of the arm, or a part and a keep-out.
    pub closest: Option<ClosePair>,
}

/// Returns the markers of the tool and the goal in `moment`, and of the tool's path (`trace`). Their namespaces are `goal`, `tool`,
/// `path`, `frames` (along the path) and `closest` (the nearest pair).
pub(super) fn markers(moment: &Moment, trace: &Trace) -> MarkerArray {
    let marker = |ns: &str, kind, width, points: Vec<Point>, colors: Vec<ColorRGBA>| Marker {
        header: moment.header.clone(),
        ns: ns.to_owned(),
        kind,
        // A line needs two points; RViz warns about fewer.
        action: if points.len() < 2 { Marker::DELETE } else { Marker::ADD },
        pose: [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0].into(),
        scale: Vector3 { x: width, ..Vector3::default() },
        color: law(moment.law),
        frame_locked: true,
        points,
        colors,
        ..Marker::default()
    };
    let frames = |ns: &str, poses: &[&Pose], Axes { length, width }: Axes| {
        let (points, colors) = poses.iter().flat_map(|pose| axes(pose, length)).unzip();
        marker(ns, Marker::LINE_LIST, width, points, colors)
    };
    let way: Vec<_> = trace.poses().iter().map(|pose| pose.position.clone()).collect();
    let tool: Vec<_> = moment.tool.iter().collect();
    let closest: Vec<_> =
        moment.closest.iter().flat_map(|pair| pair.points.iter().map(point_message)).collect();
    MarkerArray {
        markers: vec![
            frames("goal", &moment.goal.iter().collect::<Vec<_>>(), GOAL),
            frames("tool", &tool, TOOL),
            marker("path", Marker::LINE_STRIP, PATH_WIDTH, way, Vec::new()),
            marker("closest", Marker::LINE_LIST, PATH_WIDTH, closest, Vec::new()),
            frames("frames", &trace.spaced(SPACING, TURN_SPACING), ALONG_PATH),
        ],
    }
}

/// Returns the three axes of a frame, each as two end points with the color of the axis.
fn axes(pose: &Pose, length: f64) -> Vec<(Point, ColorRGBA)> {
    let (p, o) = (&pose.position, &pose.orientation);
    let rotation = UnitQuaternion::new_normalize(Quaternion::new(o.w, o.x, o.y, o.z)).to_rotation_matrix();
    let axis = |i: usize| {
        let along = length * rotation.matrix().column(i);
        let end = Point { x: p.x + along.x, y: p.y + along.y, z: p.z + along.z };
        [(p.clone(), color(AXES[i])), (end, color(AXES[i]))]
    };
    (0..3).flat_map(axis).collect()
}

/// Returns the color in which `dq_figures` draws the law `name`. For two arms, `name` is not the name of a law. Then the color is
/// that of `logc`.
fn law(name: &str) -> ColorRGBA {
    color(law_color(name.parse().unwrap_or(Law::Logc)))
}

fn color([r, g, b]: Color) -> ColorRGBA {
    let part = |part: u8| f32::from(part) / 255.0;
    ColorRGBA { r: part(r), g: part(g), b: part(b), a: 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn goal_tool_and_way_are_lines_in_the_moment_s_frame() {
        let mut trace = Trace::default();
        let at = |x: f64| -> Pose { [x, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0].into() };
        for i in 0..=10 {
            trace.take(&at(0.02 * f64::from(i)), 1);
        }
        let moment = Moment {
            header: Header::now("base_link"),
            tool: Some(at(0.2)),
            goal: Some([0.0, 0.0, 1.0, 0.0, 0.0, 0.5_f64.sqrt(), 0.5_f64.sqrt()].into()),
            motion: 1,
            law: "diffc",
            ..Moment::default()
        };
        let all = markers(&moment, &trace).markers;
        let names: Vec<_> = all.iter().map(|marker| (marker.ns.as_str(), marker.points.len())).collect();
        assert_eq!(names, [("goal", 6), ("tool", 6), ("path", 11), ("closest", 0), ("frames", 24)]);
        for marker in all.iter().filter(|marker| marker.ns != "closest") {
            assert_eq!((marker.action, &marker.header), (Marker::ADD, &moment.header), "{}", marker.ns);
            assert!(marker.colors.is_empty() || marker.colors.len() == marker.points.len());
        }
        // A quarter turn about z: the goal's x axis is along y.
        let tip = &all[0].points[1];
        assert!(
            (tip.x, tip.z) == (0.0, 1.0) || tip.x.abs() < 1e-12 && (tip.y - GOAL.length).abs() < 1e-12,
            "{tip:?}"
        );
        assert_eq!(all[0].colors[1].r, f32::from(AXES[0][0]) / 255.0);
        assert_eq!((all[2].color.r, all[2].color.b), (0.0, 178.0 / 255.0));
    }

    #[test]
    fn markers_without_content_are_deleted() {
        let all = markers(&Moment::default(), &Trace::default()).markers;
        assert!(all.iter().all(|marker| marker.action == Marker::DELETE && marker.points.is_empty()));
    }
}
