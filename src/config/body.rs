//! The arm's body as a robot description has it: capsules around the shapes by which its links run into others.

use super::scene::RADIUS;
use crate::mesh_file;
use dq_kinematics::arm::{Collision, Description, DescriptionError, Place, Shape, collisions};
use dq_space::space::{Body, Capsule, Fitted, MOST_CAPSULES, merged};
use nalgebra::Vector3;
use std::path::Path;

/// As many of one arm as let two have [`MOST_CAPSULES`] together.
const MOST: usize = MOST_CAPSULES / 2;

/// What reaches farther from its joint \[m\] is no part of an arm, but in millimetres.
const FARTHEST: f64 = 10.0;

/// What is thinner \[m\] is no part of an arm.
const THINNEST: f64 = 1e-6;

/// They are written in steps of this \[1/m\].
const STEPS: f64 = 1e4;

/// The capsules, as the parameter `body` has them, and what to warn of.
#[derive(Debug, PartialEq)]
pub(super) struct FittedBody {
    /// None where the description has no shapes for them.
    pub texts: Vec<String>,
    /// Shapes that could not be read.
    pub warning: Option<String>,
}

/// Around the shapes of each link of the arm between these frames, and of what it carries: by fixed joints, and beyond the last joint by others
/// too, a hand by its fingers where they start. A link without shapes, or with one that cannot be read, has the capsule along it that it
/// has in [`Body::along`]. `file` is the description's own, if it came from one.
///
/// # Errors
/// [`DescriptionError`].
pub(super) fn fitted(
    text: &str,
    [base, tool]: &[String; 2],
    file: Option<&Path>,
) -> Result<FittedBody, DescriptionError> {
    let description = Description::read(text, base, tool)?;
    let chain = description.arm.chain()?;
    let places = description.places(&chain)?;
    let last = chain.joint_count();
    let is_body = |place: &&Place| match place.carrier {
        0 => place.is_of_arm,
        carrier => place.is_rigid || carrier == last,
    };
    let (mut all, mut missing) = (Vec::new(), Vec::new());
    for collision in collisions(text)? {
        let Some(place) = places.get(collision.link.as_str()).filter(is_body) else { continue };
        match around(&collision, place, file) {
            Ok(fitted) => all.push((place.carrier, fitted)),
            Err(why) => missing.push((place.carrier, collision.link, why)),
        }
    }
    let warning = warning(&missing);
    let names: Vec<_> = description.arm.moving().map(|joint| joint.name.as_str()).collect();
    if all.is_empty() {
        return Ok(FittedBody { texts: Vec::new(), warning });
    }
    let is_whole =
        |joint: usize| all.iter().any(|(of, _)| *of == joint) && missing.iter().all(|(of, ..)| *of != joint);
    let along = Body::along(std::slice::from_ref(&chain), RADIUS).capsules;
    let along = along.into_iter().filter(|capsule| !is_whole(capsule.joint));
    let along: Vec<_> =
        along.map(|Capsule { joint, core, radius, .. }| (joint, Fitted { core, radius })).collect();
    // Where a joint is called so, what stands has no name.
    let base = if names.contains(&"base") { "" } else { "base" };
    let texts = merged([all, along].concat(), MOST).into_iter().map(|(joint, fitted)| {
        let joint = joint.checked_sub(1).map_or(base, |number| names[number]);
        written(joint, &fitted)
    });
    Ok(FittedBody { texts: texts.collect(), warning })
}

/// A capsule around a shape, in the frame that moves with the joint that carries it.
fn around(collision: &Collision, place: &Place, file: Option<&Path>) -> Result<Fitted, String> {
    let (link_from_shape, shape) =
        collision.shape.as_ref().ok_or("expected a box, a cylinder, a capsule, a sphere or a mesh")?;
    let fitted = match shape {
        Shape::Sphere(radius) => Fitted::ball(&Vector3::zeros(), *radius),
        Shape::Cylinder { radius, length } => Fitted::cylinder(*radius, *length),
        Shape::Capsule { radius, length } => Fitted::capsule(*radius, *length),
        Shape::Box(edges) => {
            let side = |number: usize, axis: usize| if number >> axis & 1 == 0 { -0.5 } else { 0.5 };
            let corner = |number| Vector3::from_fn(|axis, _| side(number, axis) * edges[axis]);
            Fitted::points(&(0..8).map(corner).collect::<Vec<_>>()).ok_or("it has no corners")?
        }
        Shape::Mesh { scale, .. } if scale.iter().any(|factor| *factor == 0.0) => {
            return Err("its scale is 0".to_owned());
        }
        Shape::Mesh { file: mesh, scale } => {
            let scene = mesh_file::load(mesh, file)?;
            let corners = scene.meshes.iter().flat_map(|mesh| &mesh.vertices);
            let points: Vec<_> =
                corners.map(|corner| Vector3::from(corner.map(f64::from)).component_mul(scale)).collect();
            Fitted::points(&points).ok_or_else(|| format!("{mesh} has no corners"))?
        }
    };
    let fitted = fitted.moved(&(place.carrier_from_link * *link_from_shape).frame());
    let reach = fitted.core.ends.iter().map(|end| end.norm()).fold(fitted.radius, f64::max);
    match () {
        () if fitted.radius < THINNEST => Err("it has no size".to_owned()),
        () if reach < FARTHEST => Ok(fitted),
        // Of what is no number neither is true.
        () => Err(format!("it reaches farther than {FARTHEST} m")),
    }
}

/// As the parameter has it, in tenths of a millimetre; thicker by as much as its ends may have moved by that.
fn written(joint: &str, Fitted { core, radius }: &Fitted) -> String {
    let rounded = |number: f64| (number * STEPS).round() / STEPS + 0.0;
    let ends: String = core.ends.iter().flatten().map(|number| format!(" {}", rounded(*number))).collect();
    let radius = (radius * STEPS + 0.5 * 3.0_f64.sqrt()).ceil() / STEPS;
    format!("{joint}{ends} {radius}")
}

/// What to say of the shapes of links that could not be read.
fn warning(missing: &[(usize, String, String)]) -> Option<String> {
    let (_, link, why) = missing.first()?;
    let more = match missing.len() - 1 {
        0 => String::new(),
        more => format!(", and {more} more"),
    };
    Some(format!(
        "a collision shape of link {link:?} cannot be used ({why}){more}: a capsule of {RADIUS} m along the link is in its place"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{NodeParameters, ServoParameters};
    use dq_algebra::UnitDualQuaternion;
    use dq_params::{Given, ParameterStore, Value};
    use nalgebra::Point3;
    use proptest::prelude::*;

    /// A stand, an arm of a joint that turns and one that slides, a flange fixed to it that has a finger, and a lamp on a joint of its own.
    const ROBOT: &str = r#"<robot name="r">
      <link name="stand"><collision><geometry><box size="2 2 0.5"/></geometry></collision></link>
      <link name="base"><collision><origin xyz="0 0 0.1"/><geometry><cylinder radius="0.1" length="0.2"/></geometry></collision></link>
      <link name="upper">
        <collision><origin xyz="0.15 0 0" rpy="0.3 0.2 0.1"/><geometry><box size="0.4 0.1 0.08"/></geometry></collision>
        <collision><origin xyz="0 0 0.6"/><geometry><sphere radius="0.05"/></geometry></collision>
      </link>
      <link name="lamp"><collision><geometry><sphere radius="0.3"/></geometry></collision></link>
      <link name="fore"><collision><origin xyz="0 0.1 0" rpy="0 0 1"/><geometry><mesh filename="fore.obj" scale="0.001 0.001 0.002"/></geometry></collision></link>
      <link name="flange"><collision><geometry><cylinder radius="0.04" length="0.01"/></geometry></collision></link>
      <link name="finger"><collision><geometry><box size="0.01 0.02 0.1"/></geometry></collision></link>
      <joint name="on_stand" type="fixed"><parent link="stand"/><child link="base"/><origin xyz="0 0 0.25"/></joint>
      <joint name="turn" type="continuous"><parent link="base"/><child link="upper"/><origin xyz="0 0.05 0.3" rpy="0.4 0 0"/><axis xyz="0 1 0"/>
        <limit velocity="1" effort="1"/></joint>
      <joint name="nod" type="revolute"><parent link="upper"/><child link="lamp"/><axis xyz="0 1 0"/><limit lower="-1" upper="1" velocity="1" effort="1"/></joint>
      <joint name="slide" type="prismatic"><parent link="upper"/><child link="fore"/><origin xyz="0.3 0 0" rpy="0 0.2 0"/><axis xyz="1 0 0"/>
        <limit lower="-1" upper="1" velocity="1" effort="1"/></joint>
      <joint name="wrist" type="fixed"><parent link="fore"/><child link="flange"/><origin xyz="0 0 0.2" rpy="0 1 0"/></joint>
      <joint name="grip" type="prismatic"><parent link="flange"/><child link="finger"/><origin xyz="0 0.1 0"/><axis xyz="0 0 1"/>
        <limit lower="0.02" upper="0.04" velocity="1" effort="1"/></joint>
    </robot>"#;

    /// A wedge, in mm.
    const FORE: &str = "v 0 0 0\nv 200 0 0\nv 0 80 0\nv 0 0 40\nf 1 2 3\nf 1 2 4\nf 1 3 4\nf 2 3 4\n";

    fn store(text: &str, given: &[(&str, Value)]) -> (ParameterStore, Vec<String>) {
        let description = [
            ("robot_description", Value::String(text.to_owned())),
            ("base_frame", Value::String("base".to_owned())),
            ("tool_frame", Value::String("flange".to_owned())),
            ("limits.joint_acceleration", Value::DoubleArray(vec![1.0; 2])),
        ];
        let given =
            description.iter().chain(given).map(|(name, value)| Given::new(*name, value.clone(), "test"));
        ServoParameters::start("/dq_servo", given.collect()).unwrap()
    }

    /// The robot in a file beside its mesh.
    fn with_mesh() -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("fore.obj"), FORE).unwrap();
        std::fs::write(folder.path().join("robot.urdf"), ROBOT).unwrap();
        folder
    }

    fn body_with_mesh(folder: &tempfile::TempDir) -> Body {
        let file = folder.path().join("robot.urdf").to_str().unwrap().to_owned();
        let given = [
            ("robot_description", Value::String(String::new())),
            ("robot_file", Value::String(file)),
            ("constraints", Value::Bool(true)),
        ];
        let (store, _) = store("", &given);
        ServoParameters::from_store(&store).unwrap().settings.scene.unwrap().body().clone()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(500))]
        #[test]
        fn whatever_the_joints_do_the_shapes_are_inside(
            positions in prop::array::uniform2(-1.0..1.0f64), at in prop::array::uniform3(-1.0..1.0f64)
        ) {
            let folder = with_mesh();
            let (text, body) = (ROBOT, body_with_mesh(&folder));
            let description = Description::read(text, "base", "flange").unwrap();
            let frames = description.arm.chain().unwrap().link_poses(&positions).unwrap();
            // Where links are, by the joints of the description themselves.
            let [turn, slide, wrist] = &description.arm.joints[..] else { panic!() };
            let upper = turn.parent_from_child(positions[0]);
            let fore = upper * slide.parent_from_child(positions[1]);
            let flange = fore * wrist.parent_from_child(0.0);
            let grip = description.beside.iter().find(|joint| joint.name == "grip").unwrap();
            let finger = flange * grip.parent_from_child(0.03);
            let links = [("base", UnitDualQuaternion::identity()), ("upper", upper), ("fore", fore), ("flange", flange), ("finger", finger)];
            for Collision { link, shape } in collisions(text).unwrap() {
                let Some((_, base_from_link)) = links.iter().find(|(name, _)| *name == link) else { continue };
                let (link_from_shape, shape) = shape.unwrap();
                let [a, b, c] = at;
                let round = Vector3::new(a, b, 0.0).normalize();
                let point = match shape {
                    Shape::Box(edges) => edges.component_mul(&Vector3::from(at.map(f64::signum))) / 2.0,
                    Shape::Cylinder { radius, length } => radius * round + Vector3::new(0.0, 0.0, 0.5 * c.signum() * length),
                    Shape::Capsule { .. } => panic!("there is none"),
                    Shape::Sphere(radius) => radius * Vector3::from(at).normalize(),
                    Shape::Mesh { .. } => [Vector3::zeros(), Vector3::new(0.2, 0.0, 0.0), Vector3::new(0.0, 0.08, 0.0), Vector3::new(0.0, 0.0, 0.08)]
                        [((c + 1.0) * 2.0) as usize % 4],
                };
                let point = (*base_from_link * link_from_shape).frame() * Point3::from(point);
                let beyond = body.capsules.iter().map(|capsule| {
                    let frame = capsule.joint.checked_sub(1).map_or(UnitDualQuaternion::identity(), |at| frames[at]);
                    capsule.core.gap_of(&(frame.inverse().frame() * point).coords).distance - capsule.radius
                });
                let beyond = beyond.fold(f64::INFINITY, f64::min);
                prop_assert!(beyond <= 1e-9, "{link}: {beyond} beyond {body:?}");
            }
        }
    }

    #[test]
    fn it_is_the_body_where_nobody_gives_one_and_its_links_alone() {
        let joints = |body: &Body| body.capsules.iter().map(|capsule| capsule.joint).collect::<Vec<_>>();
        let body = body_with_mesh(&with_mesh());
        // The stand is no part of the arm, and the lamp moves by itself.
        assert_eq!(joints(&body)[..2], [0, 1], "{body:?}");
        assert!(body.capsules.iter().all(|capsule| capsule.radius < 0.2), "{body:?}");
        let (given, _) = store(ROBOT, &[("body", Value::StringArray(vec!["0.07".to_owned()]))]);
        assert_eq!(given.get("body"), Some(&Value::StringArray(vec!["0.07".to_owned()])));
        let (plain, warnings) =
            store(&ROBOT.replace("collision", "visual"), &[("constraints", Value::Bool(true))]);
        assert_eq!((plain.get("body"), warnings), (Some(&Value::StringArray(Vec::new())), Vec::new()));
    }

    #[test]
    fn a_shape_that_cannot_be_used_has_the_capsule_along_its_link_and_is_said() {
        let constraints = ("constraints", Value::Bool(true));
        let (found, warnings) = store(ROBOT, std::slice::from_ref(&constraints));
        let [warning] = &warnings[..] else { panic!("{warnings:?}") };
        assert!(warning.contains("link \"fore\" cannot be used (fore.obj is not there"), "{warning}");
        let Some(Value::StringArray(texts)) = found.get("body") else { panic!() };
        assert!(
            texts.iter().any(|text| text.starts_with("slide 0 0 0 ") && text.ends_with(" 0.0501")),
            "{texts:?}"
        );
        // Who does not use it is not told.
        assert_eq!(store(ROBOT, &[]).1, Vec::<String>::new());
        let huge = ROBOT
            .replace("radius=\"0.04\"", "radius=\"40\"")
            .replace("<sphere radius=\"0.05\"/>", "<capsule/>");
        let (_, warnings) = store(&huge, &[constraints]);
        assert!(warnings[0].contains("link \"upper\" cannot be used (expected a box"), "{warnings:?}");
        assert!(warnings[0].contains("and 2 more"), "{warnings:?}");
    }
}
