//! Paths and frames in R³, in a box with axes.

use super::DrawError;
use super::canvas::{Anchor, Canvas, Figure, Line, Point, draw};
use super::chart::{Rectangle, Series, draw_entry, entry_width};
use super::curve::{range_of, spaced, ticks};
use super::labels::Labels;
use super::style::{AXES, FAINT, INK, LABEL, TICK, TITLE, text_width};
use crate::dq::UnitDualQuaternion;
use nalgebra::{Isometry3, Matrix3, Vector3, Vector6};
use plotters::style::RGBColor;
use serde_json::{Value, json};
use std::ops::Range;

/// A path of the tool.
#[derive(Clone, Debug, PartialEq)]
pub struct Path {
    /// The path's name in the legend; without one it is not there.
    pub name: String,
    /// The path's colour.
    pub color: RGBColor,
    /// How the path is drawn.
    pub line: Line,
    /// The path's points in the base frame \[m\].
    pub points: Vec<Vector3<f64>>,
}

/// A point with a name.
#[derive(Clone, Debug, PartialEq)]
pub struct Place {
    /// The name written beside the point.
    pub name: String,
    /// The point in the base frame \[m\].
    pub point: Vector3<f64>,
}

/// What is seen from one side.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// The text above the scene.
    pub title: String,
    /// The paths, later ones over earlier ones.
    pub paths: Vec<Path>,
    /// The frames that `frameplotter` draws.
    pub frames: Vec<Isometry3<f64>>,
    /// How long the axes of the frames are \[m\].
    pub axis_length: f64,
    /// Start, goal and the like.
    pub places: Vec<Place>,
    /// The viewer's azimuth and elevation \[°\].
    pub view: (f64, f64),
}

/// The paper's `frameplotter`: the frame of an element of se(3) given by the paper's logarithm (eq. 32).
pub fn frameplotter(half_log: &Vector6<f64>) -> Isometry3<f64> {
    UnitDualQuaternion::half_exp(half_log).frame()
}

/// Rows of scenes under a title, with one legend below the title.
///
/// # Errors
/// [`DrawError::Drawing`].
pub fn scenes(name: &str, title: &str, rows: &[Vec<Scene>]) -> Result<Figure, DrawError> {
    const SCENE: (f64, f64) = (500.0, 420.0);
    let columns = rows.iter().map(Vec::len).max().unwrap_or(1) as f64;
    let width = SCENE.0 * columns;
    let entries = flow(legend(rows), width);
    let top = entries.last().map_or(40.0, |(_, (_, y))| y + 16.0);
    let size = (width as u32, (SCENE.1 * rows.len() as f64 + top) as u32);
    let data =
        json!({ "title": title, "scenes": rows.iter().flatten().map(Scene::data).collect::<Vec<_>>() });
    draw(name, data, size, |canvas| {
        canvas.text(title, (14.0, 24.0), TITLE, Anchor::Left)?;
        entries.iter().try_for_each(|(series, at)| draw_entry(canvas, series, *at))?;
        for (row, scenes) in rows.iter().enumerate() {
            for (column, scene) in scenes.iter().enumerate() {
                let (left, top) = (SCENE.0 * column as f64, top + SCENE.1 * row as f64);
                scene.draw(canvas, Rectangle { left, top, width: SCENE.0, height: SCENE.1 })?;
            }
        }
        Ok(())
    })
}

/// The entries of a legend one after the other, in lines.
fn flow(entries: Vec<Series>, width: f64) -> Vec<(Series, Point)> {
    let mut at = (18.0, 54.0);
    let placed = entries.into_iter().map(|series| {
        if at.0 + entry_width(&series) > width {
            at = (18.0, at.1 + 19.0);
        }
        let place = at;
        at.0 += entry_width(&series);
        (series, place)
    });
    placed.collect()
}

fn legend(rows: &[Vec<Scene>]) -> Vec<Series> {
    let scenes = || rows.iter().flatten();
    let mut entries: Vec<Series> = Vec::new();
    let mut add = |name: &str, color, line| {
        if !name.is_empty() && !entries.iter().any(|entry| entry.name == name) {
            entries.push(Series { name: name.to_owned(), color, line, points: Vec::new() });
        }
    };
    for path in scenes().flat_map(|scene| &scene.paths) {
        add(&path.name, path.color, path.line);
    }
    if scenes().any(|scene| !scene.frames.is_empty()) {
        for (axis, color) in ["x of the tool", "y of the tool", "z of the tool"].into_iter().zip(AXES) {
            add(axis, color, Line::Solid);
        }
    }
    entries
}

/// A view of the box onto the sheet: parallel projection, all axes to one scale.
struct Projection {
    sheet_from_space: Matrix3<f64>,
    center: Vector3<f64>,
    scale: f64,
    middle: Point,
}

impl Projection {
    fn new(bounds: &[Range<f64>; 3], (azimuth, elevation): (f64, f64), frame: Rectangle) -> Self {
        let (azimuth, elevation) = (azimuth.to_radians(), elevation.to_radians());
        // Rows: to the right, upwards, towards the viewer.
        let right = Vector3::new(-azimuth.sin(), azimuth.cos(), 0.0);
        let towards =
            Vector3::new(azimuth.cos() * elevation.cos(), azimuth.sin() * elevation.cos(), elevation.sin());
        let up = towards.cross(&right);
        let sheet_from_space = Matrix3::from_rows(&[right.transpose(), up.transpose(), towards.transpose()]);
        let center = Vector3::from_iterator(bounds.iter().map(|range| 0.5 * (range.start + range.end)));
        let extent = |row: usize| {
            let reach = |corner: Vector3<f64>| (sheet_from_space * (corner - center))[row].abs();
            corners(bounds).into_iter().map(reach).fold(0.0, f64::max)
        };
        // Room for the numbers and names at the edges.
        let (width, height) = (frame.width - 150.0, frame.height - 120.0);
        let scale = (0.5 * width / extent(0)).min(0.5 * height / extent(1));
        let middle = (frame.left + 0.5 * frame.width, frame.top + 0.5 * frame.height);
        Self { sheet_from_space, center, scale, middle }
    }

    fn point(&self, point: &Vector3<f64>) -> Point {
        let seen = self.scale * self.sheet_from_space * (point - self.center);
        (self.middle.0 + seen.x, self.middle.1 - seen.y)
    }

    /// How near to the viewer.
    fn depth(&self, point: &Vector3<f64>) -> f64 {
        (self.sheet_from_space * (point - self.center)).z
    }
}

fn corners(bounds: &[Range<f64>; 3]) -> Vec<Vector3<f64>> {
    let end = |axis: usize, far: bool| if far { bounds[axis].end } else { bounds[axis].start };
    (0..8).map(|i| Vector3::new(end(0, i & 1 > 0), end(1, i & 2 > 0), end(2, i & 4 > 0))).collect()
}

impl Scene {
    fn data(&self) -> Value {
        let xyz = |point: &Vector3<f64>| [point.x, point.y, point.z];
        let path = |path: &Path| {
            // To half a millimetre.
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

    fn draw(&self, canvas: &Canvas, frame: Rectangle) -> Result<(), DrawError> {
        let bounds = self.bounds();
        let projection = Projection::new(&bounds, self.view, frame);
        canvas.text(&self.title, (frame.left + 18.0, frame.top + 12.0), LABEL, Anchor::Left)?;
        let numbers = draw_box(canvas, &projection, &bounds)?;
        for path in &self.paths {
            let points: Vec<_> = path.points.iter().map(|point| projection.point(point)).collect();
            let points = if path.line == Line::Dots { points } else { visible(&points) };
            canvas.line(&points, path.color, 1.4, path.line)?;
        }
        self.draw_frames(canvas, &projection)?;
        let places = self.named_places(&projection);
        places.iter().try_for_each(|(_, point)| canvas.dot(*point, INK, 3.2))?;
        let mut labels = Labels::new(frame, self.drawn_on(&projection), numbers);
        let mut named = places.iter().filter(|(name, _)| !name.is_empty());
        named.try_for_each(|(name, point)| labels.draw(canvas, name, *point))
    }

    /// The places on the sheet; what stands at one point has one name put together.
    fn named_places(&self, projection: &Projection) -> Vec<(String, Point)> {
        /// Dots as near as this lie on each other [px].
        const SAME: f64 = 5.0;
        let mut named: Vec<(Vec<&str>, Point)> = Vec::new();
        for place in &self.places {
            let point = projection.point(&place.point);
            match named.iter_mut().find(|(_, at)| (at.0 - point.0).hypot(at.1 - point.1) < SAME) {
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

    /// Points on all that is drawn, so close that a name between two of them would cover nothing.
    fn drawn_on(&self, projection: &Projection) -> Vec<Point> {
        const STEPS: u32 = 16;
        let paths = self.paths.iter().flat_map(|path| &path.points).map(|point| projection.point(point));
        let arrows = self.frames.iter().flat_map(|frame| {
            let origin = frame.translation.vector;
            frame_axes(frame, self.axis_length).into_iter().flat_map(move |(_, tip)| {
                (0..=STEPS).map(move |k| origin + f64::from(k) / f64::from(STEPS) * (tip - origin))
            })
        });
        visible(&paths.chain(arrows.map(|point| projection.point(&point))).collect::<Vec<_>>())
    }

    /// All that is drawn, with a little room.
    fn bounds(&self) -> [Range<f64>; 3] {
        let paths = self.paths.iter().flat_map(|path| path.points.iter().copied());
        let tips =
            self.frames.iter().flat_map(|frame| frame_axes(frame, self.axis_length).map(|(_, tip)| tip));
        let all: Vec<_> = paths.chain(tips).chain(self.places.iter().map(|place| place.point)).collect();
        let ranges: [Range<f64>; 3] =
            std::array::from_fn(|axis| range_of(all.iter().map(|point| point[axis])));
        // A path in a plane gets a box all the same.
        let least = 0.25 * ranges.iter().map(|range| range.end - range.start).fold(0.0, f64::max);
        ranges.map(|range| {
            let short = (least - (range.end - range.start)).max(0.0);
            range.start - 0.5 * short..range.end + 0.5 * short
        })
    }

    /// Each frame as three arrows, the nearest ones last.
    fn draw_frames(&self, canvas: &Canvas, projection: &Projection) -> Result<(), DrawError> {
        let mut arrows: Vec<_> = self
            .frames
            .iter()
            .flat_map(|frame| {
                let origin = frame.translation.vector;
                frame_axes(frame, self.axis_length).into_iter().map(move |(color, tip)| (origin, tip, color))
            })
            .collect();
        arrows.sort_by(|a, b| projection.depth(&a.1).total_cmp(&projection.depth(&b.1)));
        for (origin, tip, color) in arrows {
            draw_arrow(canvas, projection.point(&origin), projection.point(&tip), color)?;
        }
        let dots = self.frames.iter().map(|frame| projection.point(&frame.translation.vector));
        dots.into_iter().try_for_each(|point| canvas.dot(point, INK, 1.5))
    }
}

/// The points that can be distinguished on the sheet.
fn visible(points: &[Point]) -> Vec<Point> {
    spaced(points, |a, b| (a.0 - b.0).hypot(a.1 - b.1))
}

/// The tips of a frame's axes with their colours.
fn frame_axes(frame: &Isometry3<f64>, length: f64) -> [(RGBColor, Vector3<f64>); 3] {
    let tip = |axis| frame.translation.vector + frame.rotation * (length * axis);
    [(AXES[0], tip(Vector3::x())), (AXES[1], tip(Vector3::y())), (AXES[2], tip(Vector3::z()))]
}

fn draw_arrow(canvas: &Canvas, from: Point, to: Point, color: RGBColor) -> Result<(), DrawError> {
    canvas.line(&[from, to], color, 1.0, Line::Solid)?;
    let length = (to.0 - from.0).hypot(to.1 - from.1);
    if length < 1.0 {
        return Ok(());
    }
    let (x, y) = ((to.0 - from.0) / length, (to.1 - from.1) / length);
    let head = length.min(7.0);
    let base = (to.0 - head * x, to.1 - head * y);
    let side = |sign: f64| (base.0 - sign * 0.35 * head * y, base.1 + sign * 0.35 * head * x);
    canvas.fill(&[to, side(1.0), side(-1.0)], color)
}

/// The box's edges, and numbers along the three that are at its outline, which are returned.
fn draw_box(
    canvas: &Canvas,
    projection: &Projection,
    bounds: &[Range<f64>; 3],
) -> Result<Vec<Rectangle>, DrawError> {
    let corners = corners(bounds);
    for (i, from) in corners.iter().enumerate() {
        for to in (0..3).map(|axis| i | (1 << axis)).filter(|to| *to > i).map(|to| &corners[to]) {
            canvas.line(&[projection.point(from), projection.point(to)], FAINT, 1.0, Line::Solid)?;
        }
    }
    let mut numbers = Vec::new();
    (0..3).try_for_each(|axis| draw_axis(canvas, projection, bounds, axis, &mut numbers))?;
    Ok(numbers)
}

const NAMES: [&str; 3] = ["x [m]", "y [m]", "z [m]"];

fn draw_axis(
    canvas: &Canvas,
    projection: &Projection,
    bounds: &[Range<f64>; 3],
    axis: usize,
    numbers: &mut Vec<Rectangle>,
) -> Result<(), DrawError> {
    let edge = axis_edge(projection, bounds, axis);
    let along = |value: f64| {
        let mut point = edge;
        point[axis] = value;
        projection.point(&point)
    };
    let (start, end) = (along(bounds[axis].start), along(bounds[axis].end));
    canvas.line(&[start, end], INK, 1.0, Line::Solid)?;
    // Numbers stand off the edge, away from the box.
    let middle = (0.5 * (start.0 + end.0), 0.5 * (start.1 + end.1));
    let (nx, ny) = (start.1 - end.1, end.0 - start.0);
    let size = nx.hypot(ny).max(1.0);
    let outwards = (middle.0 - projection.middle.0) * nx + (middle.1 - projection.middle.1) * ny;
    let (nx, ny) = (nx / size * outwards.signum(), ny / size * outwards.signum());
    let off = |point: Point, distance: f64| (point.0 + distance * nx, point.1 + distance * ny);
    for (value, text) in ticks(&bounds[axis], 4) {
        let at = along(value);
        canvas.line(&[at, off(at, 4.0)], INK, 1.0, Line::Solid)?;
        // Where two axes meet their numbers may have room for one only.
        let (middle, width) = (off(at, 16.0), text_width(&text, TICK));
        let place =
            Rectangle { left: middle.0 - 0.5 * width, top: middle.1 - 0.5 * TICK, width, height: TICK };
        if !numbers.iter().any(|number| number.overlaps(&place)) {
            canvas.text(&text, middle, TICK, Anchor::Center)?;
            numbers.push(place);
        }
    }
    canvas.text(NAMES[axis], off(middle, if axis == 2 { 54.0 } else { 42.0 }), LABEL, Anchor::Center)
}

/// A point on the edge that carries the numbers: for x and y the lower one of the floor, for z the leftmost.
fn axis_edge(projection: &Projection, bounds: &[Range<f64>; 3], axis: usize) -> Vector3<f64> {
    let middle = |mut corner: Vector3<f64>| {
        corner[axis] = 0.5 * (bounds[axis].start + bounds[axis].end);
        projection.point(&corner)
    };
    let floor = |corner: &Vector3<f64>| axis == 2 || corner.z == bounds[2].start;
    let outermost = |corner: &Vector3<f64>| if axis == 2 { -middle(*corner).0 } else { middle(*corner).1 };
    let candidates = corners(bounds).into_iter().filter(floor);
    candidates.max_by(|a, b| outermost(a).total_cmp(&outermost(b))).unwrap_or_default()
}
