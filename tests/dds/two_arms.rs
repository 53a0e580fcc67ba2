//! Tests the servo for the two arms of one description, whose joints differ by a prefix.

use crate::described::wait_for_text;
use crate::host::{Host, assert_success};
use crate::replay::{assert_replays, place};
use dq_config::{DualParameters, NodeParameters};
use dq_params::{ParameterOverride, Value};
use std::fs::File;

const BAXTER: &str = concat!("robot_file:=", env!("CARGO_MANIFEST_DIR"), "/tests/data/urdf/baxter.urdf");
const BASE: &str = "base_frame:=torso";
const TOOLS: [&str; 2] = ["tool_frame:=left_gripper", "right_tool_frame:=right_gripper"];

/// Remaps the joint states of both arms to one topic.
const ONE_TOPIC: [&str; 4] =
    ["-r", "left/joint_states:=joint_states", "-r", "right/joint_states:=joint_states"];

/// Returns a goal near the start of the simulated arms: the pose of the right tool relative to the left tool.
fn goal() -> Vec<String> {
    let values = [BAXTER, BASE, TOOLS[0], TOOLS[1]].map(|value| value.split_once(":=").unwrap());
    let given =
        values.map(|(name, value)| ParameterOverride::new(name, Value::String(value.to_owned()), "test"));
    let (store, _) = DualParameters::start("/dq_dual_servo", given.into()).unwrap();
    let mut parameters = DualParameters::from_store(&store).unwrap().0;
    let ranges = parameters.settings.limits.position.ranges();
    let theta: Vec<_> = ranges.map(|(lower, upper)| 0.0_f64.clamp(lower, upper) + 0.15).collect();
    parameters.arms.evaluate(&theta);
    dq_wire::pose_numbers(&parameters.arms.pose()).iter().map(ToString::to_string).collect()
}

#[test]
fn both_arms_of_a_robot_with_one_topic_of_joint_states_move_to_a_relative_pose() {
    let mut host = Host::new();
    for (side, tool) in [("left", "tool_frame:=left_gripper"), ("right", "tool_frame:=right_gripper")] {
        let namespace = format!("__ns:=/{side}");
        host.start(side, &["arm", "--ros-args", "-r", &namespace, "-p", BAXTER, "-p", BASE, "-p", tool]);
    }
    host.start_peer(&["one_topic"]);
    let arms = ["-p", BAXTER, "-p", BASE, "-p", TOOLS[0], "-p", TOOLS[1]];
    let law =
        ["-p", "primitive:=relative_pose", "-p", "gains.damped_inverse:=4.0", "-p", "constraints:=true"];
    host.start("servo", &[&["dual", "--ros-args"], &arms[..], &law, &ONE_TOPIC].concat());
    let (_directory, bag) = place();
    let goal = goal();
    let goal: Vec<_> = goal.iter().map(String::as_str).collect();
    let to = ["--timeout", "30", "--record", bag.to_str().unwrap(), "--ros-args"];
    let arrived = host.output(&[&["goal", "--dual"], &goal[..], &to, &ONE_TOPIC].concat());
    assert!(arrived.starts_with("arrived with damped_inverse relative_pose after"), "{arrived}");
    assert!(assert_replays(&bag) > 100);
    let plots = format!("{}_plots", bag.display());
    let plot = host.run(&["plot", bag.to_str().unwrap(), "--json", "--out", &plots]);
    assert_success(&plot);
    let motions: Vec<serde_json::Value> = serde_json::from_slice(&plot.stdout).unwrap();
    assert!(motions.len() == 1 && motions[0]["path_length_m"].as_f64().unwrap() > 0.01, "{motions:?}");
}

#[test]
fn joint_states_of_both_arms_that_come_in_turn_on_one_topic_are_not_rejected() {
    let mut host = Host::new();
    for (side, tool) in [("left", "tool_frame:=left_gripper"), ("right", "tool_frame:=right_gripper")] {
        let namespace = format!("__ns:=/{side}");
        let topic = ["-r", "joint_states:=/joint_states"];
        let arm = ["arm", "--ros-args", "-r", &namespace, "-p", BAXTER, "-p", BASE, "-p", tool];
        host.start(side, &[&arm[..], &topic].concat());
    }
    let log = host.file("servo.log", "");
    let arms = ["dual", "--ros-args", "-p", BAXTER, "-p", BASE, "-p", TOOLS[0], "-p", TOOLS[1]];
    host.start_logging_to("servo", &[&arms[..], &ONE_TOPIC].concat(), File::create(&log).unwrap());
    wait_for_text(&log, "waiting_for_state -> holding");
    host.shell("sleep 1.5");
    let log = std::fs::read_to_string(&log).unwrap();
    assert!(!log.contains("rejected"), "{log}");
}

#[test]
fn a_joint_or_a_controller_of_both_arms_is_refused() {
    let host = Host::new();
    let refused = |arguments: &[&str]| {
        let output = host.run(&[&["dual", "--ros-args"], arguments].concat());
        let why = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{why}");
        why
    };
    let joint = refused(&ONE_TOPIC);
    let expected = "has \"joint1\" on /joint_states too: give right_joints or right_tool_frame";
    assert!(joint.contains(expected), "{joint}");
    let topic = "forward_velocity_controller/commands";
    let both = ["left", "right"].map(|side| format!("{side}/{topic}:={topic}"));
    let controller = refused(&["-r", &both[0], "-r", &both[1]]);
    assert!(controller.contains("each arm needs a controller of its own"), "{controller}");
}
