//! A box in R³ with numbers at its edges, seen from one direction.

use super::canvas::{Anchor, Canvas, Point, Rectangle, distance};
use super::curve::ticks;
use super::line::Line;
use super::style::{FAINT, INK, LABEL, TICK, text_width};
use nalgebra::{Matrix3, Vector3};
use std::ops::Range;

/// The direction to the viewer \[°\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Viewpoint {
    /// The angle about z, measured from the x axis.
    pub azimuth: f64,
    /// The angle above the xy plane.
    pub elevation: f64,
}

/// A parallel projection of the box onto the sheet. All axes have the same scale.
pub(super) struct Projection {
    bounds: [Range<f64>; 3],
    sheet_from_space: Matrix3<f64>,
    center: Vector3<f64>,
    scale: f64,
    middle: Point,
}

impl Projection {
    /// Creates the projection of the box from this viewpoint, in the middle of the rectangle `frame`.
    pub fn new(bounds: [Range<f64>; 3], viewpoint: Viewpoint, frame: Rectangle) -> Self {
        let (azimuth, elevation) = (viewpoint.azimuth.to_radians(), viewpoint.elevation.to_radians());
        // The rows are the directions to the right, upward, and toward the viewer.
        let right = Vector3::new(-azimuth.sin(), azimuth.cos(), 0.0);
        let towards =
            Vector3::new(azimuth.cos() * elevation.cos(), azimuth.sin() * elevation.cos(), elevation.sin());
        let up = towards.cross(&right);
        let sheet_from_space = Matrix3::from_rows(&[right.transpose(), up.transpose(), towards.transpose()]);
        let center = Vector3::from_iterator(bounds.iter().map(|range| 0.5 * (range.start + range.end)));
        let middle = (frame.left + 0.5 * frame.width, frame.top + 0.5 * frame.height);
        let mut projection = Self { bounds, sheet_from_space, center, scale: 1.0, middle };
        let seen = projection.corners().map(|corner| sheet_from_space * (corner - center));
        let extent = |row: usize| seen.iter().map(|corner| corner[row].abs()).fold(0.0, f64::max);
        // Leave space for the numbers and names at the edges of the box.
        let (width, height) = (frame.width - 150.0, frame.height - 120.0);
        projection.scale = (0.5 * width / extent(0)).min(0.5 * height / extent(1));
        projection
    }

    /// Returns the position on the sheet of a point in space.
    pub fn point(&self, point: &Vector3<f64>) -> Point {
        let seen = self.scale * self.sheet_from_space * (point - self.center);
        (self.middle.0 + seen.x, self.middle.1 - seen.y)
    }

    /// Returns how near a point is to the viewer. A nearer point has a larger value.
    pub fn depth(&self, point: &Vector3<f64>) -> f64 {
        (self.sheet_from_space * (point - self.center)).z
    }

    /// Returns the corners of the box. The three bits of a corner's index stand for the three axes: if a bit is set, the corner is
    /// at the upper end of that axis.
    fn corners(&self) -> [Vector3<f64>; 8] {
        std::array::from_fn(|i| {
            let end = |axis: usize| match i & (1 << axis) {
                0 => self.bounds[axis].start,
                _ => self.bounds[axis].end,
            };
            Vector3::new(end(0), end(1), end(2))
        })
    }

    /// Draws the edges of the box, and numbers along three edges of its outline. Returns the rectangles that the numbers cover, so
    /// that names can avoid them.
    pub fn draw_box(&self, canvas: &mut Canvas) -> Vec<Rectangle> {
        let corners = self.corners().map(|corner| self.point(&corner));
        for (i, from) in corners.iter().enumerate() {
            for to in (0..3).map(|axis| i | (1 << axis)).filter(|to| *to > i) {
                canvas.line(&[*from, corners[to]], FAINT, 1.0, Line::Solid);
            }
        }
        let mut numbers = Vec::new();
        (0..3).for_each(|axis| self.draw_axis(canvas, axis, &mut numbers));
        numbers
    }

    fn draw_axis(&self, canvas: &mut Canvas, axis: usize, numbers: &mut Vec<Rectangle>) {
        const NAMES: [&str; 3] = ["x [m]", "y [m]", "z [m]"];
        let edge = self.edge(axis);
        let along = |value: f64| {
            let mut point = edge;
            point[axis] = value;
            self.point(&point)
        };
        let (start, end) = (along(self.bounds[axis].start), along(self.bounds[axis].end));
        canvas.line(&[start, end], INK, 1.0, Line::Solid);
        // The numbers are beside the edge, away from the box.
        let middle = along(self.center[axis]);
        let size = distance(start, end).max(1.0);
        let (nx, ny) = ((start.1 - end.1) / size, (end.0 - start.0) / size);
        let side = ((middle.0 - self.middle.0) * nx + (middle.1 - self.middle.1) * ny).signum();
        let off =
            |point: Point, distance: f64| (point.0 + side * distance * nx, point.1 + side * distance * ny);
        for (value, text) in ticks(&self.bounds[axis], 4.0) {
            let at = along(value);
            canvas.line(&[at, off(at, 4.0)], INK, 1.0, Line::Solid);
            // Near a corner, where two numbers would overlap, only one is drawn.
            let place = Rectangle::around(off(at, 16.0), text_width(&text, TICK), TICK);
            if !numbers.iter().any(|number| number.overlaps(&place)) {
                canvas.text(&text, off(at, 16.0), TICK, Anchor::Center);
                numbers.push(place);
            }
        }
        canvas.text(NAMES[axis], off(middle, if axis == 2 { 54.0 } else { 42.0 }), LABEL, Anchor::Center);
    }

    /// Returns the middle of the edge along which the numbers of `axis` are written. For x and y this is the lowest edge on the
    /// sheet, for z the leftmost edge.
    fn edge(&self, axis: usize) -> Vector3<f64> {
        let middles = self.corners().map(|mut corner| {
            corner[axis] = self.center[axis];
            corner
        });
        let outermost = |point: &Vector3<f64>| {
            let (x, y) = self.point(point);
            if axis == 2 { -x } else { y }
        };
        let of_floor = middles.into_iter().filter(|point| axis == 2 || point.z == self.bounds[2].start);
        of_floor.max_by(|a, b| outermost(a).total_cmp(&outermost(b))).unwrap_or_default()
    }
}
