//! Outlines of keep-outs and keep-ins near the paths that a figure shows.

use dq_space::space::{Segment, Shape};
use nalgebra::{Isometry3, Point3, Vector3};
use std::f64::consts::PI;

/// The distance between the points of a line \[m\].
const STEP: f64 = 5e-3;
/// A keep-out is drawn up to this distance from the bounding box of the paths \[m\].
const MARGIN: f64 = 0.25;
/// The number of points of a circle.
const ROUND: u32 = 48;

/// Returns the parts of the shape's outline \[m\] that are within [`MARGIN`] of the bounding box of `points`. For a half-space, the
/// outline is a grid of lines in its plane.
pub(super) fn outline(shape: &Shape, points: &[Vector3<f64>]) -> Vec<Vec<Vector3<f64>>> {
    let Some(first) = points.first() else { return Vec::new() };
    let grow = Vector3::repeat(MARGIN);
    let low = points.iter().fold(*first, |low, point| low.inf(point)) - grow;
    let high = points.iter().fold(*first, |high, point| high.sup(point)) + grow;
    let is_near = |point: &Vector3<f64>| *point >= low && *point <= high;
    let reach = 0.5 * (high - low).norm();
    let lines = lines(shape, &(0.5 * (low + high)), reach);
    let near = |line: Vec<Vector3<f64>>| {
        let parts = line.chunk_by(|one, next| is_near(one) == is_near(next));
        parts.filter(|part| is_near(&part[0])).map(bends).collect::<Vec<_>>()
    };
    lines.into_iter().flat_map(near).collect()
}

/// Removes the points at which a line goes straight on. Keeps its ends, and the points at which it bends.
fn bends(line: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let bends = |at: &usize| {
        let around = at.checked_sub(1).and_then(|before| Some((line.get(before)?, line.get(at + 1)?)));
        around.is_none_or(|(before, after)| (line[*at] - before).cross(&(after - line[*at])).norm() > 1e-9)
    };
    (0..line.len()).filter(bends).map(|at| line[at]).collect()
}

/// Returns lines that show a shape \[m\]. A half-space is shown within `reach` of `middle`.
fn lines(shape: &Shape, middle: &Vector3<f64>, reach: f64) -> Vec<Vec<Vector3<f64>>> {
    match shape {
        Shape::HalfSpace(plane) => {
            let center = middle - plane.distance(middle) * plane.normal();
            grid(&Segment::about(&center, &plane.normal()).frame(), reach)
        }
        Shape::Sphere { center, radius } => [Vector3::x(), Vector3::y(), Vector3::z()]
            .map(|axis| circle(&Segment::about(center, &axis), *radius))
            .to_vec(),
        Shape::Capsule { core, radius } => {
            let across = [Vector3::x(), Vector3::y()].map(|side| core.frame() * side);
            let ends = core
                .ends
                .iter()
                .flat_map(|end| across.map(|axis| circle(&Segment::about(end, &axis), *radius)));
            tube(core, *radius).into_iter().chain(ends).collect()
        }
        Shape::Cylinder { axis, center, radius, half_length } => {
            tube(&Segment::about(center, &(*half_length * axis.direction())), *radius)
        }
        Shape::Box { base_from_box, half } => edges(base_from_box, half),
        Shape::Hull(hull) => hull.edges().map(|ends| straight(&Segment { ends })).collect(),
    }
}

/// Returns the edges of a box. `half` has half their lengths.
fn edges(base_from_box: &Isometry3<f64>, half: &Vector3<f64>) -> Vec<Vec<Vector3<f64>>> {
    let corner = |signs: [f64; 3]| base_from_box * Point3::from(half.component_mul(&Vector3::from(signs)));
    let edge = |ends: [[f64; 3]; 2]| straight(&Segment { ends: ends.map(|signs| corner(signs).coords) });
    let along = |(s, t): (f64, f64)| {
        [[[-1.0, s, t], [1.0, s, t]], [[s, -1.0, t], [s, 1.0, t]], [[s, t, -1.0], [s, t, 1.0]]].map(edge)
    };
    [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)].into_iter().flat_map(along).collect()
}

/// Returns a grid of lines in the xy plane of a frame, up to `reach` from its origin.
fn grid(frame: &Isometry3<f64>, reach: f64) -> Vec<Vec<Vector3<f64>>> {
    let line = |ends: [[f64; 2]; 2]| {
        straight(&Segment {
            ends: ends.map(|[x, y]| (frame * Point3::new(reach * x, reach * y, 0.0)).coords),
        })
    };
    let both = |at: f64| [[[at, -1.0], [at, 1.0]], [[-1.0, at], [1.0, at]]].map(line);
    (-3..=3).flat_map(|at| both(f64::from(at) / 3.0)).collect()
}

/// Returns the circles at both ends of a cylinder, and four lines along it.
fn tube(core: &Segment, radius: f64) -> Vec<Vec<Vector3<f64>>> {
    let frame = core.frame();
    let along = [Vector3::x(), Vector3::y(), -Vector3::x(), -Vector3::y()]
        .map(|out| straight(&Segment { ends: core.ends.map(|end| end + radius * (frame * out)) }));
    let ends = core.ends.iter().map(|end| circle(&Segment::about(end, &core.vector()), radius));
    ends.chain(along).collect()
}

/// Returns the circle of this radius around the middle of `axis`, perpendicular to `axis`.
fn circle(axis: &Segment, radius: f64) -> Vec<Vector3<f64>> {
    let frame = axis.frame();
    let at = |angle: f64| frame * Point3::from(radius * Vector3::new(angle.cos(), angle.sin(), 0.0));
    (0..=ROUND).map(|i| at(2.0 * PI * f64::from(i) / f64::from(ROUND)).coords).collect()
}

/// Returns points on `line`, at intervals of about [`STEP`]. They are close together because [`outline`] can cut a line only
/// between two points.
fn straight(line: &Segment) -> Vec<Vector3<f64>> {
    let count = (line.vector().norm() / STEP).ceil().clamp(1.0, 1e4);
    (0..=count as u32).map(|i| line.at(f64::from(i) / count)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use dq_space::space::KeepOut;

    #[test]
    fn an_outline_lies_on_its_shape_and_near_the_path() {
        let path = [Vector3::new(-0.6, -0.6, -0.6), Vector3::new(0.6, 0.6, 0.6)];
        let turned = "0.36 0.48 0.0 0.8";
        for text in [
            "floor half_space 0.2 0.3 1 0.1",
            "ball sphere 0.1 0.0 0.2 0.3",
            &format!("crate box 0.1 0.0 0.2 0.3 0.4 0.5 {turned}"),
            &format!("post cylinder 0.1 0.0 0.2 0.1 0.5 {turned}"),
            &format!("pipe capsule 0.1 0.0 0.2 0.1 0.5 {turned}"),
            "beam box 0 0 0 9 0.1 0.1",
            "tent hull 0 0 0 0.5 0 0 0 0.5 0 0.5 0.5 0 0.2 0.2 0.4",
        ] {
            let keep_out: KeepOut = text.parse().unwrap();
            let lines = outline(&keep_out.shape, &path);
            assert!(lines.len() >= 3, "{text}: {}", lines.len());
            for point in lines.iter().flatten() {
                assert!(
                    keep_out.shape.distance(point).0.abs() < 1e-9 || text.starts_with("pipe"),
                    "{text}: {point}"
                );
                assert!(point.amax() <= 0.6 + MARGIN, "{text}: {point}");
            }
        }
        assert!(outline(&"far sphere 5 0 0 0.3".parse::<KeepOut>().unwrap().shape, &path).is_empty());
    }
}
