//! What the arm must keep out of, as markers.

use crate::dq::UnitDualQuaternion;
use crate::space::{Scene, Segment, Shape};
use crate::wire::messages::{Header, Vector3};
use crate::wire::visualization::{ColorRGBA, Marker};
use nalgebra::{Isometry3, Translation3};

/// Of a half-space so much is drawn of its plane, and so thick \[m\].
const PLANE: (f64, f64) = (2.0, 0.002);

/// They are seen through.
const COLOR: ColorRGBA = ColorRGBA { r: 0.85, g: 0.3, b: 0.1, a: 0.4 };

/// A marker each for what `scene` keeps out of, but three for a capsule, and markers that remove those of `before` besides.
pub(super) fn keep_outs(header: &Header, scene: Option<&Scene>, before: usize) -> Vec<Marker> {
    let shapes = scene.iter().flat_map(|scene| scene.keep_outs());
    let marker = |(id, solid): (usize, Option<Solid>)| {
        let action = if solid.is_some() { Marker::ADD } else { Marker::DELETE };
        let Solid { kind, frame, size: [x, y, z] } = solid.unwrap_or_default();
        Marker {
            header: header.clone(),
            ns: "keep_out".to_owned(),
            id: i32::try_from(id).unwrap_or(i32::MAX),
            kind,
            action,
            pose: (&UnitDualQuaternion::from(frame)).into(),
            scale: Vector3 { x, y, z },
            color: COLOR,
            frame_locked: true,
            ..Marker::default()
        }
    };
    let mut all: Vec<_> = shapes.flat_map(|keep_out| solids(&keep_out.shape)).map(Some).collect();
    all.resize(all.len().max(before), None);
    all.into_iter().enumerate().map(marker).collect()
}

/// What one marker draws: a constant of [`Marker`], where, and how large \[m\].
#[derive(Clone, Copy, Default)]
struct Solid {
    kind: i32,
    frame: Isometry3<f64>,
    size: [f64; 3],
}

fn solids(shape: &Shape) -> Vec<Solid> {
    let ball = |center: &nalgebra::Vector3<f64>, radius: f64| Solid {
        kind: Marker::SPHERE,
        frame: Translation3::from(*center).into(),
        size: [2.0 * radius; 3],
    };
    let cylinder = |core: &Segment, radius: f64| Solid {
        kind: Marker::CYLINDER,
        frame: core.frame(),
        size: [2.0 * radius, 2.0 * radius, core.way().norm()],
    };
    match shape {
        Shape::HalfSpace(plane) => {
            let (side, thick) = PLANE;
            let through =
                Segment { ends: [thick, 0.0].map(|below| (plane.offset() - below) * plane.normal()) };
            vec![Solid { kind: Marker::CUBE, frame: through.frame(), size: [side, side, thick] }]
        }
        Shape::Sphere { center, radius } => vec![ball(center, *radius)],
        Shape::Box { base_from_box, half } => {
            vec![Solid { kind: Marker::CUBE, frame: *base_from_box, size: (2.0 * half).into() }]
        }
        Shape::Cylinder { axis, center, radius, half_length } => {
            let half = *half_length * axis.direction();
            vec![cylinder(&Segment { ends: [center - half, center + half] }, *radius)]
        }
        Shape::Capsule { core, radius } => {
            let [one, other] = core.ends;
            vec![cylinder(core, *radius), ball(&one, *radius), ball(&other, *radius)]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::space::{Body, KeepOut};

    #[test]
    fn each_shape_is_drawn_where_it_is_and_removed_when_it_is_gone() {
        let texts = [
            "table half_space 0 0 2 0.1",
            "ball sphere 1 2 3 0.5",
            "crate box 1 0 0 0.2 0.4 0.6",
            "pipe cylinder 0 1 0 0.1 2 1 0 0 0",
            "beam capsule 0 0 1 0.1 2",
        ];
        let keep_outs_of = texts.map(|text| text.parse::<KeepOut>().unwrap()).to_vec();
        let scene = Scene::new(Body { capsules: Vec::new() }, keep_outs_of, &[], &[]);
        let all = keep_outs(&Header::now("base"), Some(&scene), 9);
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
        assert!(seen[7..].iter().all(|it| it.4 == Marker::DELETE) && seen.len() == 9);
    }
}
