//! Tests of two arms, alike or different, from one robot description or from two.

use crate::{given, text};
use dq_algebra::UnitDualQuaternion;
use dq_config::{DualParameters, NodeParameters, ServoParameters};
use dq_description::Description;
use dq_params::Value;
use dq_space::space::Pair;
use nalgebra::Vector3;

const BAXTER: &str = include_str!("../../../tests/data/urdf/baxter.urdf");
const UR5: &str = include_str!("../../../tests/data/urdf/ur5.urdf");
const PANDA: &str = include_str!("../../../tests/data/urdf/panda.urdf");

/// A robot with a sliding torso that carries a left arm of two joints and a right arm of three.
const ROBOT: &str = r#"<robot name="r">
  <link name="floor"/><link name="torso"/><link name="l1"/><link name="left_tool"/><link name="r1"/><link name="r2"/><link name="right_tool"/>
  <joint name="lift" type="prismatic"><parent link="floor"/><child link="torso"/><axis xyz="0 0 1"/><limit lower="0" upper="1" velocity="0.1" effort="1"/></joint>
  <joint name="left_1" type="revolute"><parent link="torso"/><child link="l1"/><origin xyz="0 0.2 1"/><limit lower="-1" upper="1" velocity="1" effort="1"/></joint>
  <joint name="left_2" type="revolute"><parent link="l1"/><child link="left_tool"/><origin xyz="0 0 0.4"/><limit lower="-2" upper="2" velocity="2" effort="1"/></joint>
  <joint name="right_1" type="revolute"><parent link="torso"/><child link="r1"/><origin xyz="0 -0.2 1"/><limit lower="-3" upper="3" velocity="3" effort="1"/></joint>
  <joint name="right_2" type="continuous"><parent link="r1"/><child link="r2"/><origin xyz="0 0 0.4"/><axis xyz="0 0 1"/><limit velocity="4" effort="1"/></joint>
  <joint name="right_3" type="prismatic"><parent link="r2"/><child link="right_tool"/><limit lower="0" upper="0.5" velocity="0.5" effort="1"/></joint>
</robot>"#;

fn strings(list: &[&str]) -> Value {
    Value::StringArray(list.iter().map(|text| (*text).to_owned()).collect())
}

fn started(values: &[(&str, Value)]) -> Result<ServoParameters, String> {
    let (store, warnings) =
        DualParameters::start("/dq_dual_servo", given(values)).map_err(|why| why.to_string())?;
    assert_eq!(warnings, [""; 0]);
    let parameters = DualParameters::from_store(&store).map_err(|why| why.to_string())?.0;
    // A dump starts an identical node.
    let dump: Vec<_> = store.iter().map(|(declared, value)| (declared.name, value.clone())).collect();
    let (again, _) = DualParameters::start("/dq_dual_servo", given(&dump)).unwrap();
    assert_eq!(DualParameters::from_store(&again).unwrap().0, parameters);
    Ok(parameters)
}

fn arms_of<'a>(description: &str, base: &str, left: &str, right: &str) -> Vec<(&'a str, Value)> {
    vec![
        ("robot_description", text(description)),
        ("base_frame", text(base)),
        ("tool_frame", text(left)),
        ("right_tool_frame", text(right)),
    ]
}

#[test]
fn both_arms_of_one_description_keep_out_of_each_other() {
    let mut values = arms_of(BAXTER, "torso", "left_gripper", "right_gripper");
    values.push(("constraints", Value::Bool(true)));
    let parameters = started(&values).unwrap();
    let sides = [("left_gripper", "left_"), ("right_gripper", "right_")];
    for ((tool, prefix), (chain, joints)) in
        sides.into_iter().zip(parameters.arms.chains().zip(&parameters.joints))
    {
        assert!(joints.names().len() == 7 && joints.names().iter().all(|name| name.starts_with(prefix)));
        let alone = Description::read(BAXTER, "torso", tool).unwrap().arm.chain().unwrap();
        let theta = [0.1, -0.2, 0.3, 0.4, -0.5, 0.6, 0.7];
        assert_eq!(chain.forward_kinematics(&theta).unwrap(), alone.forward_kinematics(&theta).unwrap());
    }
    assert_eq!((&*parameters.goal_frame, &*parameters.tool_frame), ("left_gripper", "right_gripper"));
    assert_eq!(parameters.settings.limits.joint_velocity.len(), 14);
    let scene = parameters.settings.scene.unwrap();
    let mut pairs = (0..scene.pair_count()).map(|number| scene.pair(number));
    assert!(pairs.any(
        |pair| matches!(pair, Pair::Body(one, other) if (one > 7) != (other > 7) && one.min(other) > 0)
    ));
}

#[test]
fn different_arms_have_the_limits_of_each_joint() {
    let values = arms_of(ROBOT, "torso", "left_tool", "right_tool");
    let parameters = started(&values).unwrap();
    let names: Vec<_> = parameters.joints.iter().map(|arm| arm.names().to_vec()).collect();
    assert_eq!(names, [vec!["left_1", "left_2"], vec!["right_1", "right_2", "right_3"]]);
    let limits = &parameters.settings.limits;
    assert_eq!(limits.joint_velocity, [1.0, 2.0, 3.0, 4.0, 0.5]);
    assert_eq!((limits.position.lower[2], limits.position.upper[4]), (-3.0, 0.5));
    let with = |name, value| started(&[&values[..], &[(name, value)]].concat());
    let slower = with("limits.joint_velocity", Value::DoubleArray(vec![0.5; 5])).unwrap();
    assert_eq!(slower.settings.limits.joint_acceleration, [1.0; 5]);
    let short = with("limits.joint_velocity", Value::DoubleArray(vec![0.5; 2])).unwrap_err();
    assert!(short.contains("5 numbers"), "{short}");
}

#[test]
fn arms_of_two_descriptions_have_a_body_each() {
    let ball = |link: &str| {
        format!(
            "<link name=\"{link}\"><collision><geometry><sphere radius=\"0.2\"/></geometry></collision></link>"
        )
    };
    let with_ball =
        |urdf: &str, link: &str| urdf.replacen(&format!("<link name=\"{link}\" />"), &ball(link), 1);
    let (left, right) = (with_ball(UR5, "base_link"), with_ball(PANDA, "panda_link0"));
    assert!(left.contains("sphere") && right.contains("sphere"));
    let parameters = started(&[
        ("robot_description", text(&left)),
        ("base_frame", text("base_link")),
        ("tool_frame", text("tool0")),
        ("right_robot_description", text(&right)),
        ("right_base_frame", text("panda_link0")),
        ("right_tool_frame", text("panda_link8")),
        ("right_base", Value::DoubleArray(vec![0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 1.0])),
        ("constraints", Value::Bool(true)),
    ])
    .unwrap();
    assert_eq!(parameters.joints.iter().map(|arm| arm.names().len()).collect::<Vec<_>>(), [6, 7]);
    let scene = parameters.settings.scene.unwrap();
    let bases: Vec<_> = scene.body().capsules.iter().filter(|capsule| capsule.radius > 0.15).collect();
    assert_eq!(bases.iter().map(|base| base.core.ends[0].y.round()).collect::<Vec<_>>(), [0.0, 2.0]);
    assert!(bases.iter().all(|base| base.link == 0));
    let last = scene.body().capsules.iter().map(|capsule| capsule.link).max();
    assert_eq!(last, Some(13));
}

#[test]
fn the_right_one_of_two_arms_alike_may_have_other_joint_names() {
    let names = ["a1", "a2", "a3", "a4", "a5", "a6"];
    let parameters = started(&[("right_joints", strings(&names))]).unwrap();
    assert_eq!(parameters.joints[0].names()[0], "joint1");
    assert_eq!(parameters.joints[1].names(), names);
    let base = UnitDualQuaternion::from_parts(nalgebra::UnitQuaternion::identity(), Vector3::x());
    let ur5e = ServoParameters::for_two_arms("ur5e", &base).unwrap();
    assert_eq!(ur5e.joints[0], ur5e.joints[1]);
    let short = started(&[("right_joints", strings(&names[..5]))]).unwrap_err();
    assert!(short.contains("6 names"), "{short}");
    let twice = started(&[("right_joints", strings(&["a"; 6]))]).unwrap_err();
    assert!(twice.contains("\"right_joints\"") && twice.contains("repeated"), "{twice}");
}

#[test]
fn arms_with_a_common_joint_are_refused_with_the_remedy() {
    let refused = |values: &[(&str, Value)]| started(values).unwrap_err();
    let common = refused(&arms_of(ROBOT, "floor", "left_tool", "right_tool"));
    assert!(common.contains("\"lift\" moves both, so give a base_frame beyond it"), "{common}");
    let same = refused(&arms_of(ROBOT, "torso", "left_tool", "left_tool"));
    assert!(same.contains("the tool frame of the other arm"), "{same}");
    let mut values = arms_of(ROBOT, "torso", "left_tool", "right_tool");
    values.push(("right_base_frame", text("r1")));
    let other = refused(&values);
    assert!(other.contains("give a base_frame from which both arms hang"), "{other}");
    let alone = refused(&[("right_tool_frame", text("hand"))]);
    assert!(alone.contains("give robot_description or robot_file"), "{alone}");
    let asked = refused(&[("robot_description", text(BAXTER))]);
    assert!(asked.contains("several arms: give tool_frame"), "{asked}");
}
