//! Paths and frames in R³, in a box with axes.

use super::canvas::{Anchor, Canvas, Point, Rectangle, distance};
use super::colors::{AXES, Color};
use super::curve::{range_of, spaced};
use super::labels::Labels;
use super::line::Line;
use super::projection::{Projection, Viewpoint};
use super::series::Series;
use super::style::{INK, LABEL, WHITE};
use dq_algebra::UnitDualQuaternion;
use nalgebra::{Isometry3, Vector3, Vector6};
use serde_json::{Value, json};
use std::ops::Range;

/// A path of the tool.
#[derive(Clone, Debug, PartialEq)]
pub struct Path {
    /// The name of the path in the legend; empty for no entry.
    pub name: String,
    /// The color of the path.
    pub color: Color,
    /// The style of the line.
    pub line: Line,
    /// The points of the path in the base frame \[m\].
    pub points: Vec<Vector3<f64>>,
}

/// A point with a name.
#[derive(Clone, Debug, PartialEq)]
pub struct Place {
    /// The name, which is written beside the point.
    pub name: String,
    /// The point in the base frame \[m\].
    pub point: Vector3<f64>,
}

/// A view of paths and frames from one direction.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// The text above the scene.
    pub title: String,
    /// The paths. Later paths are drawn over earlier paths.
    pub paths: Vec<Path>,
    /// The frames. Each is drawn as its three axes.
    pub frames: Vec<Isometry3<f64>>,
    /// The length of the axes of the frames \[m\].
    pub axis_length: f64,
    /// Named points, such as start and goal.
    pub places: Vec<Place>,
    /// The direction to the viewer.
    pub viewpoint: Viewpoint,
}

/// Two viewpoints: in front of the arm, and behind it.
pub const BOTH_SIDES: [Viewpoint; 2] =
    [Viewpoint { azimuth: -60.0, elevation: 20.0 }, Viewpoint { azimuth: 165.0, elevation: 15.0 }];

/// Returns the frame that the paper's program `frameplotter` draws for `half_log`, the paper's logarithm of a pose (eq. 32).
pub fn frameplotter(half_log: &Vector6<f64>) -> Isometry3<f64> {
    UnitDualQuaternion::half_exp(half_log).frame()
}

/// An axis of a frame, with its color.
struct Arrow {
    origin: Vector3<f64>,
    tip: Vector3<f64>,
    color: Color,
}

impl Scene {
    /// Returns the data of the scene as JSON: its title, paths, named points and frames \[m\].
    pub(super) fn data(&self) -> Value {
        let xyz = |point: &Vector3<f64>| [point.x, point.y, point.z];
        let path = |path: &Path| {
            // Points are at least half a millimeter apart.
            let points = spaced(&path.points, |a, b| (a - b).norm() / 5e-4);
            json!({ "name": path.name, "points_m": points.iter().map(xyz).collect::<Vec<_>>() })
        };
        let place = |place: &Place| json!({ "name": place.name, "point_m": xyz(&place.point) });
        let frame = |frame: &Isometry3<f64>| {
            let q = frame.rotation;
            json!({ "origin_m": xyz(&frame.translation.vector), "quaternion_wxyz": [q.w, q.i, q.j, q.k] })
        };
        json!({
            "title": self.title,
            "paths": self.paths.iter().map(path).collect::<Vec<_>>(),
            "places": self.places.iter().map(place).collect::<Vec<_>>(),
            "frames": self.frames.iter().map(frame).collect::<Vec<_>>(),
        })
    }

    /// Returns the entries of the legend: the paths, and the axes if there are frames.
    pub(super) fn legend(&self) -> Vec<Series> {
        let entry =
            |name: &str, color, line| Series { name: name.to_owned(), color, line, points: Vec::new() };
        let axes = ["x of the tool", "y of the tool", "z of the tool"].into_iter().zip(AXES);
        let axes =
            axes.filter(|_| !self.frames.is_empty()).map(|(name, color)| entry(name, color, Line::Solid));
        self.paths.iter().map(|path| entry(&path.name, path.color, path.line)).chain(axes).collect()
    }

    pub(super) fn draw(&self, canvas: &mut Canvas, frame: Rectangle) {
        let projection = Projection::new(self.bounds(), self.viewpoint, frame);
        canvas.text(&self.title, (frame.left + 18.0, frame.top + 12.0), LABEL, Anchor::Left);
        let numbers = projection.draw_box(canvas);
        self.draw_frames(canvas, &projection);
        for path in &self.paths {
            let points: Vec<_> = path.points.iter().map(|point| projection.point(point)).collect();
            let points = if path.line == Line::Dots { points } else { visible(&points) };
            if !self.frames.is_empty() {
                // A white edge separates the path from the frames below.
                canvas.line(&points, WHITE, 4.0, Line::Solid);
            }
            canvas.line(&points, path.color, 1.8, path.line);
        }
        for frame in self.distinct_frames(&projection) {
            canvas.dot(projection.point(&frame.translation.vector), INK, 1.8);
        }
        let places = self.named_places(&projection);
        places.iter().for_each(|(_, point)| canvas.dot(*point, INK, 3.2));
        let mut labels = Labels::new(frame, self.drawn_on(&projection), numbers);
        let named = places.iter().filter(|(name, _)| !name.is_empty());
        named.for_each(|(name, point)| labels.draw(canvas, name, *point));
    }

    /// Returns the named points on the sheet. Names at the same point are joined.
    fn named_places(&self, projection: &Projection) -> Vec<(String, Point)> {
        /// Two points that are closer together than this coincide \[px\].
        const SAME: f64 = 5.0;
        let mut named: Vec<(Vec<&str>, Point)> = Vec::new();
        for place in &self.places {
            let point = projection.point(&place.point);
            match named.iter_mut().find(|(_, at)| distance(*at, point) < SAME) {
                Some((names, _)) if place.name.is_empty() || names.contains(&place.name.as_str()) => {}
                Some((names, _)) => names.push(&place.name),
                None => named.push((vec![&place.name], point)),
            }
        }
        let joined = |names: Vec<&str>| {
            names.into_iter().filter(|name| !name.is_empty()).collect::<Vec<_>>().join(", ")
        };
        named.into_iter().map(|(names, point)| (joined(names), point)).collect()
    }

    /// Returns the axes of all frames as arrows.
    fn arrows(&self) -> impl Iterator<Item = Arrow> {
        self.frames.iter().flat_map(|frame| self.axes(frame))
    }

    /// Returns the axes of a frame as arrows.
    fn axes(&self, frame: &Isometry3<f64>) -> [Arrow; 3] {
        let origin = frame.translation.vector;
        let unit = [Vector3::x(), Vector3::y(), Vector3::z()];
        std::array::from_fn(|axis| Arrow {
            origin,
            tip: origin + frame.rotation * (self.axis_length * unit[axis]),
            color: AXES[axis],
        })
    }

    /// Returns the frames that differ visibly from each other, from the last to the first.
    fn distinct_frames(&self, projection: &Projection) -> Vec<&Isometry3<f64>> {
        /// Two frames are alike if neither their origins nor the tips of their axes are farther apart than this \[px\].
        const ALIKE: f64 = 14.0;
        let mut kept: Vec<(&Isometry3<f64>, [Point; 4])> = Vec::new();
        for frame in self.frames.iter().rev() {
            let [x, y, z] = self.axes(frame).map(|arrow| projection.point(&arrow.tip));
            let points = [projection.point(&frame.translation.vector), x, y, z];
            let is_like =
                |other: &[Point; 4]| points.iter().zip(other).all(|(a, b)| distance(*a, *b) < ALIKE);
            if !kept.iter().any(|(_, other)| is_like(other)) {
                kept.push((frame, points));
            }
        }
        kept.into_iter().map(|(frame, _)| frame).collect()
    }

    /// Returns points on all drawn lines. The points are close together, so that a name that covers no point covers no line either.
    fn drawn_on(&self, projection: &Projection) -> Vec<Point> {
        const STEPS: u32 = 16;
        let paths = self.paths.iter().flat_map(|path| &path.points).copied();
        let arrows = self.arrows().flat_map(|Arrow { origin, tip, .. }| {
            (0..=STEPS).map(move |k| origin + f64::from(k) / f64::from(STEPS) * (tip - origin))
        });
        visible(&paths.chain(arrows).map(|point| projection.point(&point)).collect::<Vec<_>>())
    }

    /// Returns the range of x, y and z that contains the paths, frames and named points, with a margin \[m\]. Each side of this box
    /// is at least a quarter of the longest range.
    fn bounds(&self) -> [Range<f64>; 3] {
        let paths = self.paths.iter().flat_map(|path| path.points.iter().copied());
        let tips = self.arrows().map(|arrow| arrow.tip);
        let all: Vec<_> = paths.chain(tips).chain(self.places.iter().map(|place| place.point)).collect();
        let ranges: [Range<f64>; 3] =
            std::array::from_fn(|axis| range_of(all.iter().map(|point| point[axis])));
        // The box of a path in a plane gets a volume, too.
        let least = 0.25 * ranges.iter().map(|range| range.end - range.start).fold(0.0, f64::max);
        ranges.map(|range| {
            let short = (least - (range.end - range.start)).max(0.0);
            range.start - 0.5 * short..range.end + 0.5 * short
        })
    }

    /// Draws each frame as three arrows, the farthest from the viewer first.
    fn draw_frames(&self, canvas: &mut Canvas, projection: &Projection) {
        let mut arrows: Vec<_> =
            self.distinct_frames(projection).into_iter().flat_map(|frame| self.axes(frame)).collect();
        arrows.sort_by(|a, b| projection.depth(&a.tip).total_cmp(&projection.depth(&b.tip)));
        for Arrow { origin, tip, color } in arrows {
            draw_arrow(canvas, projection.point(&origin), projection.point(&tip), color);
        }
    }
}

/// Leaves out points that are too close to the previous point to be distinguished on the sheet.
fn visible(points: &[Point]) -> Vec<Point> {
    spaced(points, |a, b| distance(*a, *b))
}

fn draw_arrow(canvas: &mut Canvas, from: Point, to: Point, color: Color) {
    canvas.line(&[from, to], color, 1.0, Line::Solid);
    let length = distance(from, to);
    if length < 1.0 {
        return;
    }
    let (x, y) = ((to.0 - from.0) / length, (to.1 - from.1) / length);
    let head = length.min(7.0);
    let base = (to.0 - head * x, to.1 - head * y);
    let side = |sign: f64| (base.0 - sign * 0.35 * head * y, base.1 + sign * 0.35 * head * x);
    canvas.fill(&[to, side(1.0), side(-1.0)], color);
}
