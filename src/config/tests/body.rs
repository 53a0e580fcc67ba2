//! Tests of the body of an arm whose robot description has shapes.

use dq_algebra::UnitDualQuaternion;
use dq_config::{NodeParameters, ServoParameters};
use dq_description::{Collision, Description, Shape, collisions};
use dq_params::{ParameterOverride, ParameterStore, Value};
use dq_space::space::Body;
use nalgebra::{Point3, Vector3};
use proptest::prelude::*;

/// A robot with a stand, an arm with a revolute and a prismatic joint, a flange with a finger, and a lamp on its own joint.
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

/// The mesh of a wedge, in millimeters.
const FORE: &str = "v 0 0 0\nv 200 0 0\nv 0 80 0\nv 0 0 40\nf 1 2 3\nf 1 2 4\nf 1 3 4\nf 2 3 4\n";

fn store(text: &str, given: &[(&str, Value)]) -> (ParameterStore, Vec<String>) {
    let description = [
        ("robot_description", Value::String(text.to_owned())),
        ("base_frame", Value::String("base".to_owned())),
        ("tool_frame", Value::String("flange".to_owned())),
        ("limits.joint_acceleration", Value::DoubleArray(vec![1.0; 2])),
    ];
    let given = description
        .iter()
        .chain(given)
        .map(|(name, value)| ParameterOverride::new(*name, value.clone(), "test"));
    ServoParameters::start("/dq_servo", given.collect()).unwrap()
}

/// Writes the robot and its mesh into a folder.
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
    fn the_shapes_are_inside_of_the_body_at_any_joint_positions(
        positions in prop::array::uniform2(-1.0..1.0f64), at in prop::array::uniform3(-1.0..1.0f64)
    ) {
        let folder = with_mesh();
        let (text, body) = (ROBOT, body_with_mesh(&folder));
        let description = Description::read(text, "base", "flange").unwrap();
        let frames = description.arm.chain().unwrap().link_poses(&positions).unwrap();
        // Computes the poses of the links from the joints of the description.
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
                let frame = capsule.link.checked_sub(1).map_or(UnitDualQuaternion::identity(), |at| frames[at]);
                capsule.core.gap_of(&(frame.inverse().frame() * point).coords).distance - capsule.radius
            });
            let beyond = beyond.fold(f64::INFINITY, f64::min);
            prop_assert!(beyond <= 1e-9, "{link}: {beyond} beyond {body:?}");
        }
    }
}

#[test]
fn the_shapes_of_the_arms_links_are_the_body_unless_one_is_given() {
    let joints = |body: &Body| body.capsules.iter().map(|capsule| capsule.link).collect::<Vec<_>>();
    let body = body_with_mesh(&with_mesh());
    // The stand is not part of the arm, and the lamp moves independently of the arm.
    assert_eq!(joints(&body)[..2], [0, 1], "{body:?}");
    assert!(body.capsules.iter().all(|capsule| capsule.radius < 0.2), "{body:?}");
    let (given, _) = store(ROBOT, &[("body", Value::StringArray(vec!["0.07".to_owned()]))]);
    assert_eq!(given.get("body"), Some(&Value::StringArray(vec!["0.07".to_owned()])));
    let (plain, warnings) =
        store(&ROBOT.replace("collision", "visual"), &[("constraints", Value::Bool(true))]);
    assert_eq!((plain.get("body"), warnings), (Some(&Value::StringArray(Vec::new())), Vec::new()));
}

#[test]
fn a_link_with_an_unusable_shape_gets_a_capsule_and_a_warning() {
    let constraints = ("constraints", Value::Bool(true));
    let (found, warnings) = store(ROBOT, std::slice::from_ref(&constraints));
    let [warning] = &warnings[..] else { panic!("{warnings:?}") };
    assert!(warning.contains("link \"fore\" cannot be used (fore.obj is not there"), "{warning}");
    let Some(Value::StringArray(texts)) = found.get("body") else { panic!() };
    assert!(
        texts.iter().any(|text| text.starts_with("slide 0 0 0 ") && text.ends_with(" 0.0501")),
        "{texts:?}"
    );
    // Without constraints, nothing is reported.
    assert_eq!(store(ROBOT, &[]).1, Vec::<String>::new());
    let huge =
        ROBOT.replace("radius=\"0.04\"", "radius=\"40\"").replace("<sphere radius=\"0.05\"/>", "<capsule/>");
    let (_, warnings) = store(&huge, &[constraints]);
    assert!(warnings[0].contains("link \"upper\" cannot be used (expected a box"), "{warnings:?}");
    assert!(warnings[0].contains("and 2 more"), "{warnings:?}");
}
