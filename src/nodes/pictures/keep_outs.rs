//! The keep-outs and keep-ins as markers.

use dq_algebra::UnitDualQuaternion;
use dq_messages::messages::{Header, Point, Vector3};
use dq_messages::visualization::{ColorRGBA, Marker};
use dq_space::space::{KeepOut, Scene, Segment, Shape};
use dq_wire::{point_message, pose_message};
use nalgebra::{Isometry3, Translation3};

/// A half-space is drawn as a square plate with this side and thickness \[m\].
const SIDE: f64 = 2.0;
const THICKNESS: f64 = 0.002;

/// The color of keep-outs. The next color is that of keep-ins. Both colors are transparent.
const OUT: ColorRGBA = ColorRGBA { r: 0.85, g: 0.3, b: 0.1, a: 0.4 };
const IN: ColorRGBA = ColorRGBA { r: 0.1, g: 0.6, b: 0.3, a: 0.15 };

/// Returns the markers of the keep-outs and keep-ins of `scene`. `before` has the number of keep-out markers and the number of keep-in
/// markers in the previous message. This function updates both numbers.
pub(super) fn solids(header: &Header, scene: Option<&Scene>, before: &mut [usize; 2]) -> Vec<Marker> {
    let [out, inside] = [Scene::keep_outs, Scene::keep_ins].map(|of| scene.map(of).unwrap_or_default());
    let out = markers(header, "keep_out", OUT, out, before[0]);
    let inside = markers(header, "keep_in", IN, inside, before[1]);
    *before = [out.len(), inside.len()];
    [out, inside].concat()
}

/// Returns one marker for each shape, but three for a capsule. `before` is the number of markers in the previous message. If it is
/// larger, adds markers that delete the remaining old ones.
fn markers(header: &Header, ns: &str, color: ColorRGBA, shapes: &[KeepOut], before: usize) -> Vec<Marker> {
    let marker = |(id, solid): (usize, Option<Solid>)| {
        let action = if solid.is_some() { Marker::ADD } else { Marker::DELETE };
        let Solid { kind, frame, size: [x, y, z], points } = solid.unwrap_or_default();
        Marker {
            header: header.clone(),
            ns: ns.to_owned(),
            id: i32::try_from(id).unwrap_or(i32::MAX),
            kind,
            action,
            pose: pose_message(&UnitDualQuaternion::from(frame)),
            scale: Vector3 { x, y, z },
            color: color.clone(),
            frame_locked: true,
            points,
            ..Marker::default()
        }
    };
    let mut all: Vec<_> = shapes.iter().flat_map(|one| drawn(&one.shape)).map(Some).collect();
    all.resize(all.len().max(before), None);
    all.into_iter().enumerate().map(marker).collect()
}

/// The content of one marker: a type constant of [`Marker`], a frame, and a size \[m\]. For triangles the size is a factor.
#[derive(Clone, Default)]
struct Solid {
    kind: i32,
    frame: Isometry3<f64>,
    size: [f64; 3],
    /// The corners of triangles \[m\].
    points: Vec<Point>,
}

fn drawn(shape: &Shape) -> Vec<Solid> {
    let solid = |kind, frame, size| Solid { kind, frame, size, points: Vec::new() };
    let ball = |center: &nalgebra::Vector3<f64>, radius: f64| {
        solid(Marker::SPHERE, Translation3::from(*center).into(), [2.0 * radius; 3])
    };
    let cylinder = |core: &Segment, radius: f64| {
        solid(Marker::CYLINDER, core.frame(), [2.0 * radius, 2.0 * radius, core.vector().norm()])
    };
    match shape {
        Shape::HalfSpace(plane) => {
            let through =
                Segment { ends: [THICKNESS, 0.0].map(|below| (plane.offset() - below) * plane.normal()) };
            vec![solid(Marker::CUBE, through.frame(), [SIDE, SIDE, THICKNESS])]
        }
        Shape::Sphere { center, radius } => vec![ball(center, *radius)],
        Shape::Box { base_from_box, half } => {
            vec![solid(Marker::CUBE, *base_from_box, (2.0 * half).into())]
        }
        Shape::Cylinder { axis, center, radius, half_length } => {
            vec![cylinder(&Segment::about(center, &(*half_length * axis.direction())), *radius)]
        }
        Shape::Capsule { core, radius } => {
            let [one, other] = core.ends;
            vec![cylinder(core, *radius), ball(&one, *radius), ball(&other, *radius)]
        }
        Shape::Hull(hull) => {
            let points = hull.triangles().flatten().map(point_message).collect();
            vec![Solid { points, ..solid(Marker::TRIANGLE_LIST, Isometry3::identity(), [1.0; 3]) }]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dq_space::space::Body;

    #[test]
    fn each_shape_is_drawn_where_it_is_and_removed_when_it_is_gone() {
        let texts = [
            "table half_space 0 0 2 0.1",
            "ball sphere 1 2 3 0.5",
            "crate box 1 0 0 0.2 0.4 0.6",
            "pipe cylinder 0 1 0 0.1 2 1 0 0 0",
            "beam capsule 0 0 1 0.1 2",
            "tent hull 0 0 0 1 0 0 0 1 0 0 0 0.5",
        ];
        let keep_outs_of = texts.map(|text| text.parse::<KeepOut>().unwrap()).to_vec();
        let scene = Scene::new(Body { capsules: Vec::new() }, keep_outs_of, &[], &[]).unwrap();
        let cell = vec!["cell box 0 0 0.5 1 1 1".parse::<KeepOut>().unwrap()];
        let (scene, mut before) = (scene.staying_in(cell, &[], &[]).unwrap(), [9, 0]);
        let mut all = solids(&Header::now("base"), Some(&scene), &mut before);
        assert_eq!(before, [9, 1]);
        let tent = all[7].clone();
        let inside = all.pop().unwrap();
        assert_eq!(
            (inside.ns.as_str(), inside.id, inside.kind, inside.scale.z),
            ("keep_in", 0, Marker::CUBE, 1.0)
        );
        assert!(all.iter().all(|marker| marker.ns == "keep_out"));
        let seen: Vec<_> = all
            .iter()
            .map(|marker| {
                (marker.kind, marker.scale.x, marker.scale.z, marker.pose.position.z, marker.action)
            })
            .collect();
        let add = Marker::ADD;
        assert_eq!(seen[0], (Marker::CUBE, 2.0, 0.002, 0.099, add));
        assert_eq!(seen[1], (Marker::SPHERE, 1.0, 1.0, 3.0, add));
        assert_eq!(seen[2], (Marker::CUBE, 0.2, 0.6, 0.0, add));
        assert_eq!(seen[3], (Marker::CYLINDER, 0.2, 2.0, 0.0, add));
        assert_eq!(seen[4..7].iter().map(|it| it.3).collect::<Vec<_>>(), [1.0, 0.0, 2.0]);
        assert_eq!(seen[7], (Marker::TRIANGLE_LIST, 1.0, 1.0, 0.0, add));
        assert_eq!((tent.points.len(), tent.points.iter().filter(|it| it.z == 0.5).count()), (12, 3));
        assert!(seen[8..].iter().all(|it| it.4 == Marker::DELETE) && seen.len() == 9);
    }
}
