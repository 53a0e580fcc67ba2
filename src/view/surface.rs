//! A set of triangles that are drawn together, in the page's format.

use dq_description::mesh_file;
use dq_description::{Rgb, Shape};
use mesh_loader::Mesh;
use nalgebra::{Isometry3, Point3, Vector3};
use std::collections::HashMap;
use std::f64::consts::TAU;
use std::path::Path;

/// The three corners of a triangle.
pub(super) type Triangle = [Corner; 3];

/// A corner of a triangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corner {
    /// The position \[m\].
    pub place: Point3<f64>,
    pub normal: Vector3<f64>,
}

/// The number of sides with which cylinders and balls are drawn.
const SIDES: usize = 32;

/// The key of a corner: the corner's cell, its normal rounded to quarters, and its color. Corners with equal keys are merged.
type CornerKey = ([i32; 3], [i8; 3], [u8; 3]);

/// Triangles with shared corners.
#[derive(Default)]
pub(super) struct Surface {
    /// The position, normal and color of each corner.
    pub corners: Vec<[f32; 9]>,
    /// The three corners of each triangle.
    pub triangles: Vec<[u32; 3]>,
    known: HashMap<CornerKey, u32>,
}

impl Surface {
    /// Adds a triangle. Merges corners in the same cell (edge length `cell` \[m\]) that have the same color and nearly the same
    /// normal. Leaves out triangles that are smaller than a cell.
    pub fn add(&mut self, triangle: &Triangle, color: Rgb, cell: f64) {
        let indices = triangle.map(|corner| self.corner(&corner, color, cell));
        let [a, b, c] = indices;
        if a != b && b != c && c != a {
            self.triangles.push(indices);
        }
    }

    fn corner(&mut self, Corner { place, normal }: &Corner, color: Rgb, cell: f64) -> u32 {
        let key = (
            [place.x, place.y, place.z].map(|part| (part / cell).round() as i32),
            [normal.x, normal.y, normal.z].map(|part| (4.0 * part).round() as i8),
            color.map(|part| (255.0 * part) as u8),
        );
        *self.known.entry(key).or_insert_with(|| {
            let [x, y, z] = [place.x, place.y, place.z].map(|part| part as f32);
            let [i, j, k] = [normal.x, normal.y, normal.z].map(|part| part as f32);
            let [red, green, blue] = color;
            self.corners.push([x, y, z, i, j, k, red, green, blue]);
            (self.corners.len() - 1) as u32
        })
    }
}

/// Returns the triangles of a shape in the shape's own frame; empty for a mesh.
pub(super) fn triangles(shape: &Shape) -> Vec<Triangle> {
    match *shape {
        Shape::Mesh { .. } => Vec::new(),
        Shape::Box(edges) => boxed(edges),
        Shape::Cylinder { radius, length } => {
            let half = 0.5 * length;
            let (down, out, up) = ((-1.0, 0.0), (0.0, 1.0), (1.0, 0.0));
            let profile = [
                (-half, 0.0, down),
                (-half, radius, down),
                (-half, radius, out),
                (half, radius, out),
                (half, radius, up),
                (half, 0.0, up),
            ];
            turned(&profile)
        }
        Shape::Capsule { radius, length } => ball(radius, length),
        Shape::Sphere(radius) => ball(radius, 0.0),
    }
}

/// Returns the triangles of a capsule along z whose core has this length. A length of 0 gives a ball.
fn ball(radius: f64, length: f64) -> Vec<Triangle> {
    let at = |step: usize, middle: f64| {
        let (sin, cos) = (TAU * (step as f64 / SIDES as f64 - 0.25)).sin_cos();
        (middle + radius * sin, radius * cos, (sin, cos))
    };
    let lower = (0..=SIDES / 4).map(|step| at(step, -0.5 * length));
    let upper = (SIDES / 4..=SIDES / 2).map(|step| at(step, 0.5 * length));
    turned(&lower.chain(upper).collect::<Vec<_>>())
}

/// Returns the triangles of the mesh `file` without scaling. Each triangle comes with its color, if it has one. `description` is
/// the file of the robot description, if the description came from a file.
///
/// # Errors
/// The reason why the mesh cannot be read.
pub(super) fn mesh(file: &str, description: Option<&Path>) -> Result<Vec<(Triangle, Option<Rgb>)>, String> {
    let scene = mesh_file::load(file, description)?;
    let color = |at: usize| scene.materials.get(at).and_then(|material| material.color.diffuse);
    let triangles = scene.meshes.iter().enumerate().flat_map(|(at, mesh)| {
        let color = color(at).map(|[red, green, blue, _]| [red, green, blue]);
        mesh.faces.iter().filter_map(move |face| Some((triangle(mesh, *face)?, color)))
    });
    Ok(triangles.collect())
}

/// Returns a triangle; `None` if the face has invalid corners or no area.
fn triangle(mesh: &Mesh, face: [u32; 3]) -> Option<Triangle> {
    let [a, b, c] =
        face.map(|at| mesh.vertices.get(at as usize).map(|place| Point3::from(place.map(f64::from))));
    let corners = [a?, b?, c?];
    let flat = (corners[1] - corners[0]).cross(&(corners[2] - corners[0])).try_normalize(1e-18)?;
    let normal = |at: u32| {
        let given = mesh.normals.get(at as usize).map(|normal| Vector3::from(normal.map(f64::from)));
        given.and_then(|normal| normal.try_normalize(1e-9)).unwrap_or(flat)
    };
    let triangle = [0, 1, 2].map(|at| Corner { place: corners[at], normal: normal(face[at]) });
    let is_finite =
        |Corner { place, normal }: &Corner| place.iter().chain(normal.iter()).all(|part| part.is_finite());
    triangle.iter().all(is_finite).then_some(triangle)
}

/// A point of a profile in the half-plane beside the z axis: its position along z \[m\], its distance from the z axis \[m\], and
/// its normal as components along z and away from the z axis.
type Meridian = (f64, f64, (f64, f64));

/// Returns the surface that a profile sweeps when it turns about z.
fn turned(profile: &[Meridian]) -> Vec<Triangle> {
    let corner = |&(along, away, (forward, out)): &Meridian, side: usize| {
        let (sin, cos) = (TAU * side as f64 / SIDES as f64).sin_cos();
        let normal = Vector3::new(out * cos, out * sin, forward);
        Corner { place: Point3::new(away * cos, away * sin, along), normal }
    };
    let rings = profile.iter().zip(&profile[1..]);
    rings
        .flat_map(|(lower, upper)| {
            (0..SIDES).flat_map(move |side| {
                let [a, b] = [side, side + 1].map(|side| corner(lower, side));
                let [c, d] = [side, side + 1].map(|side| corner(upper, side));
                [[a, b, c], [c, b, d]]
            })
        })
        .collect()
}

fn boxed(edges: Vector3<f64>) -> Vec<Triangle> {
    let half = 0.5 * edges;
    let side = |axis: usize, sign: f64| {
        let mut normal = Vector3::zeros();
        normal[axis] = sign;
        let corner = |u: f64, v: f64| {
            let mut place = Point3::origin();
            place[axis] = sign * half[axis];
            place[(axis + 1) % 3] = u * half[(axis + 1) % 3];
            place[(axis + 2) % 3] = v * half[(axis + 2) % 3];
            Corner { place, normal }
        };
        let [a, b, c, d] = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0)];
        [[a, b, c], [c, b, d]]
    };
    (0..3).flat_map(|axis| [-1.0, 1.0].into_iter().flat_map(move |sign| side(axis, sign))).collect()
}

/// Transforms a triangle.
pub(super) fn moved(triangle: &Triangle, to: &Isometry3<f64>) -> Triangle {
    triangle.map(|Corner { place, normal }| Corner { place: to * place, normal: to * normal })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(triangles: &[Triangle]) -> f64 {
        let of = |[a, b, c]: &Triangle| 0.5 * (b.place - a.place).cross(&(c.place - a.place)).norm();
        triangles.iter().map(of).sum()
    }

    #[test]
    fn shapes_have_their_surface_and_normals_outwards() {
        let shapes = [
            (Shape::Box(Vector3::new(1.0, 2.0, 3.0)), 22.0),
            (Shape::Cylinder { radius: 0.5, length: 2.0 }, TAU * 0.5 * (0.5 + 2.0)),
            (Shape::Capsule { radius: 0.5, length: 2.0 }, TAU * 0.5 * 3.0),
            (Shape::Sphere(0.5), TAU * 0.5),
        ];
        for (shape, expected) in shapes {
            let triangles = triangles(&shape);
            assert!((area(&triangles) / expected - 1.0).abs() < 0.02, "{shape:?}");
            let outwards = |Corner { place, normal }: &Corner| place.coords.dot(normal) > 0.0;
            assert!(triangles.iter().flatten().all(outwards), "{shape:?}");
        }
    }

    #[test]
    fn identical_corners_are_merged() {
        let mut surface = Surface::default();
        let all = triangles(&Shape::Box(Vector3::repeat(1.0)));
        all.iter().for_each(|triangle| surface.add(triangle, [1.0; 3], 1e-3));
        assert_eq!((surface.corners.len(), surface.triangles.len()), (24, 12));
        // Details smaller than a cell are left out.
        all.iter().for_each(|triangle| surface.add(triangle, [0.5; 3], 10.0));
        assert_eq!(surface.triangles.len(), 12);
    }

    #[test]
    fn meshes_are_read_and_invalid_ones_have_a_reason() {
        let corner = "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid s\n";
        let folder = tempfile::tempdir().unwrap();
        let own = folder.path().join("robot.urdf");
        let read = |name: &str, content: &str| {
            std::fs::write(folder.path().join(name), content).unwrap();
            mesh(name, Some(&own))
        };
        let [(triangle, color)] = read("a.stl", corner).unwrap()[..] else { panic!() };
        assert_eq!(
            (triangle[1].place, triangle[0].normal, color),
            (Point3::new(1.0, 0.0, 0.0), Vector3::z(), None)
        );
        let square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n";
        assert_eq!(read("b.obj", square).unwrap().len(), 2);
        for damaged in ["solid s\nfacet normal", "v 0 0\nf 1 2 9", "<COLLADA></COLLADA", ""] {
            for kind in ["stl", "obj", "dae"] {
                let read = read(&format!("c.{kind}"), damaged);
                assert!(read.is_err() || read.is_ok_and(|read| read.is_empty()), "{kind}: {damaged}");
            }
        }
        assert!(mesh("no.stl", None).unwrap_err().contains("is not there"));
    }
}
