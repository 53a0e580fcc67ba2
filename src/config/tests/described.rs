//! Tests of the values that nodes take from a robot description.

use crate::{given, start, started, text};
use dq_config::{ForArm, NodeParameters, PlantParameters, ServoParameters};
use dq_core::servo::{Measured, State};
use dq_description::{Description, Motion};
use dq_params::Value;
use std::time::Duration;

pub const GANTRY: &str = include_str!("../../../tests/data/urdf/gantry.urdf");

fn file(name: &str) -> String {
    format!("{}/../../tests/data/urdf/{name}.urdf", env!("CARGO_MANIFEST_DIR"))
}

fn read(name: &str) -> String {
    std::fs::read_to_string(file(name)).unwrap()
}

pub fn frames(base: &str, tool: &str) -> [(&'static str, Value); 2] {
    [("base_frame", text(base)), ("tool_frame", text(tool))]
}

#[test]
fn a_description_provides_what_is_not_set_and_parameters_override_it() {
    let mut values = frames("a", "e").to_vec();
    values.push(("robot_description", text(GANTRY)));
    let limits = started(&values).unwrap().settings.limits;
    assert_eq!(limits.joint_velocity, [1.5, 0.5, 3.0]);
    assert_eq!(limits.joint_acceleration, [3.0, 1.0, 6.0]);
    assert_eq!(
        (limits.position.lower[..2].to_vec(), limits.position.upper[..2].to_vec()),
        (vec![-1.0, -0.1], vec![2.0, 0.4])
    );
    assert!(limits.position.lower[2] <= -1e5 && limits.position.upper[2] >= 1e5, "continuous");
    values.push(("limits.joint_velocity", Value::DoubleArray(vec![1.0, 0.2, 1.0])));
    let parameters = started(&values).unwrap();
    assert_eq!(parameters.settings.limits.joint_velocity, [1.0, 0.2, 1.0]);
    assert_eq!(parameters.joints[0].names(), ["j1", "j2", "j3"]);

    let (store, _) = start(&values).unwrap();
    let Some(Value::String(in_force)) = store.get("robot_description") else { panic!() };
    assert!(!in_force.contains("finger") && in_force.contains("j2"), "what counts of it: {in_force}");
    // A dump starts an identical node.
    let dump: Vec<_> = store.iter().map(|(declared, value)| (declared.name, value.clone())).collect();
    assert_eq!(started(&dump).unwrap(), parameters);
    let (plant, _) = PlantParameters::start("/arm", given(&values)).unwrap();
    assert_eq!(plant.get("robot_description"), Some(&text(GANTRY)), "published whole");
    assert_eq!(PlantParameters::from_store(&plant).unwrap().initial_positions, [0.0; 3]);
}

#[test]
fn an_incomplete_description_is_rejected() {
    let description = ("robot_description", text(&GANTRY.replace("<limit velocity='3' effort='1'/>", "")));
    let with = |more: &[(&'static str, Value)]| {
        let mut values = frames("a", "e").to_vec();
        values.extend_from_slice(more);
        started(&values)
    };
    let why = with(std::slice::from_ref(&description)).unwrap_err();
    assert!(why.contains("\"j3\"") && why.contains("limits.joint_velocity"), "{why}");
    with(&[description.clone(), ("limits.joint_velocity", Value::DoubleArray(vec![1.0; 3]))]).unwrap();
    // The frames are guessed.
    let why = started(&[description]).unwrap_err();
    assert!(why.contains("limits.joint_velocity"), "{why}");
    let why = with(&[]).unwrap_err();
    assert!(why.contains("robot_description or robot_file"), "{why}");
    let why = with(&[("robot_file", text("/nowhere.urdf"))]).unwrap_err();
    assert!(why.starts_with("/nowhere.urdf: "), "{why}");
    let other = Value::StringArray(vec!["j1".to_owned(), "j3".to_owned(), "j2".to_owned()]);
    let gantry = ("robot_description", text(GANTRY));
    let why = with(&[gantry, ("joints", other)]).unwrap_err();
    assert!(why.contains("joints") && why.contains("[\"j1\", \"j2\", \"j3\"]"), "{why}");
    let slow = ("limits.joint_deceleration", Value::DoubleArray(vec![9.0, 0.4, 9.0]));
    let gantry = ("robot_description", text(GANTRY));
    let why = with(&[gantry, slow]).unwrap_err();
    assert!(why.contains("for joint 2: expected at least 0.5 m/s^2"), "{why}");
}

#[test]
fn a_description_from_a_file_is_the_same_arm() {
    let mut values = frames("base_link", "arm_tool_link").to_vec();
    values.push(("robot_file", text(&file("tiago"))));
    let parameters = started(&values).unwrap();
    assert_eq!(parameters.settings.limits.joint_velocity[0], 0.07);
    let moving = Description::read(&read("tiago"), "base_link", "arm_tool_link").unwrap().arm;
    assert_eq!(moving.moving().next().unwrap().motion, Motion::Prismatic);
    assert_eq!(parameters.joints[0].names()[0], "torso_lift_joint");
}

/// Checks a robot in which the joint of the lever drives the forearm, although the lever is not a link between base and tool.
#[test]
fn an_arm_with_mimic_joints_is_moved_by_their_drivers() {
    let mut values = frames("base_link", "tool0").to_vec();
    values.push(("robot_file", text(&file("mimic/palletizer"))));
    values.push(("constraints", Value::Bool(true)));
    let capsules = ["forearm_joint 0 0 0 1 0 0 0.1", "lever_joint 0 0 0 1 0 0 0.1"].map(str::to_owned);
    values.push(("body", Value::StringArray(capsules[..1].to_vec())));
    let parameters = started(&values).unwrap();
    assert_eq!(parameters.joints[0].names(), ["turret_joint", "arm_joint", "lever_joint", "flange_joint"]);
    assert_eq!(parameters.settings.limits.position.upper, [2.8, 1.4, 2.0, 5.2]);
    assert_eq!(parameters.settings.scene.as_ref().unwrap().body().capsules[0].link, 4);
    let mut servo = parameters.build().unwrap();
    let (mut positions, mut speeds) = ([0.2, 0.3, 0.4, -0.5], [0.0; 4]);
    let goal = parameters.arms.chain().forward_kinematics(&[0.8, 0.6, 0.9, 0.5]).unwrap();
    servo.set_goal(goal.frame());
    for cycle in 1..5000 {
        let measured = Measured { positions: &positions, velocities: &speeds };
        if let Some(output) = servo.cycle(cycle * Duration::from_millis(2), &measured).unwrap() {
            speeds.copy_from_slice(output);
        }
        positions.iter_mut().zip(&speeds).for_each(|(position, speed)| *position += 0.002 * speed);
    }
    assert_eq!(servo.status().state, State::Settled, "at {positions:?}");
    values.pop();
    values.push(("body", Value::StringArray(capsules.to_vec())));
    let why = started(&values).unwrap_err();
    assert!(why.contains("lever_joint") && why.contains("the name of a joint, or base"), "{why}");
}

#[test]
fn guessed_frames_are_reported() {
    let (store, warnings) = start(&[("robot_file", text(&file("ur5")))]).unwrap();
    let frames = "from base_frame \"base_link\" to tool_frame \"tool0\" (also near its end: \"wrist_3_link\", \"ee_link\"): ";
    assert!(warnings.len() == 1 && warnings[0].contains(frames), "{warnings:?}");
    let parameters = ServoParameters::from_store(&store).unwrap();
    assert_eq!((parameters.goal_frame.as_str(), parameters.tool_frame.as_str()), ("base_link", "tool0"));
}

#[test]
fn built_in_arms_match_their_descriptions() {
    for (name, base, tool, rounding) in
        [("panda", "panda_link0", "panda_link8", 1e-9), ("xarm7", "link_base", "link_eef", 1e-4)]
    {
        let description = Description::read(&read(name), base, tool).unwrap().arm;
        let (described, parameters) = (description.chain().unwrap(), ServoParameters::for_arm(name).unwrap());
        let names: Vec<_> = description.moving().map(|joint| joint.name.as_str()).collect();
        assert_eq!(parameters.joints[0].names(), names);
        for factor in [-1.0, 0.3, 1.7] {
            let theta: Vec<_> = (0..names.len()).map(|i| factor * (0.2 + 0.3 * i as f64)).collect();
            let (ours, theirs) = (parameters.arms.chain(), &described);
            let [ours, theirs] = [ours, theirs].map(|chain| chain.forward_kinematics(&theta).unwrap());
            assert!((ours.translation() - theirs.translation()).norm() < rounding, "{name} at {theta:?}");
            assert!(ours.rotation().angle_to(&theirs.rotation()) < 10.0 * rounding, "{name} at {theta:?}");
        }
        let limits = &parameters.settings.limits;
        for (i, joint) in description.moving().enumerate() {
            let close = |one: f64, other: Option<f64>| (one - other.unwrap()).abs() < 1e-4;
            assert!(close(limits.position.lower[i], joint.limits.lower), "{name} {}", joint.name);
            assert!(close(limits.position.upper[i], joint.limits.upper), "{name} {}", joint.name);
            assert!(close(limits.joint_velocity[i], joint.limits.velocity), "{name} {}", joint.name);
        }
    }
}
