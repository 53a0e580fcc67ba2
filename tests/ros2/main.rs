//! Tests with a real ROS 2: nodes of rclpy over Fast DDS, from each distribution's packages on PyPI (tests/install.sh).

#[path = "../dds/host.rs"]
mod host;
#[path = "../dds/routed.rs"]
mod routed;
mod teleoperation;

use host::{FAR, FAST, Host, assert_success, wait_for_line};
use routed::Routed;

/// The path of the peer program on Eclipse Cyclone, which these tests do not use.
const PEER: &str = "";

/// The cases of the nodes of rclpy.
const CASES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/ros2/peer.py");

/// Returns the Python of a distribution of ROS 2.
fn python(distribution: &str) -> String {
    format!("{}/target/{distribution}/bin/python", env!("CARGO_MANIFEST_DIR"))
}

fn two_arms_are_used_from(distribution: &str) {
    let mut host = Host::new();
    for (side, namespace) in [("left", "__ns:=/left"), ("right", "__ns:=/right")] {
        host.start(&format!("{side} plant"), &["puma560", "--ros-args", "-r", namespace]);
        host.start_servo(side, &[&FAST[..], &["-r", namespace]].concat());
    }
    for case in ["goals", "parameters", "graph"] {
        let mut peer = host.command("timeout");
        assert_success(&peer.args(["60", &python(distribution), CASES, case]).output().unwrap());
    }
}

fn a_robot_is_moved_of(distribution: &str) {
    let mut host = Host::new();
    host.start_program("robot", &python(distribution), &[CASES, "robot"]);
    let servo = host.start("servo", &[&["servo"], &FAST[..]].concat());
    wait_for_line(servo, "publishes BEST_EFFORT only");
    let arrived = host.output(&FAR);
    assert!(arrived.starts_with("arrived"), "{arrived}");
    assert!(host.output(&["status"]).contains("settled"));
}

#[test]
fn a_goal_yields_to_the_wrench_of_a_sensor_of_jazzy() {
    let mut host = Host::new();
    host.start("plant", &["puma560"]);
    host.start_servo("servo", &[&FAST[..], &["-p", "contact.compliance:=true"]].concat());
    let mut peer = host.command("timeout");
    assert_success(&peer.args(["90", &python("jazzy"), CASES, "wrench"]).output().unwrap());
}

/// Fast DDS answers an announcement by unicast, so its side need not name anyone.
#[test]
fn a_robot_of_jazzy_behind_a_router_is_moved_if_ros_static_peers_has_its_host() {
    let mut hosts = Routed::new();
    hosts.plant_side.start_program("robot", &python("jazzy"), &[CASES, "robot"]);
    let peers = [("ROS_STATIC_PEERS", "10.77.2.2")];
    let servo = hosts.servo_side.start_with("servo", &[&["servo"], &FAST[..]].concat(), &peers);
    wait_for_line(servo, "publishes BEST_EFFORT only");
    let arrived = hosts.servo_side.output(&FAR);
    assert!(arrived.starts_with("arrived"), "{arrived}");
}

#[test]
fn two_arms_are_used_from_jazzy() {
    two_arms_are_used_from("jazzy");
}

#[test]
fn two_arms_are_used_from_kilted() {
    two_arms_are_used_from("kilted");
}

#[test]
fn a_robot_of_jazzy_is_moved() {
    a_robot_is_moved_of("jazzy");
}

#[test]
fn a_robot_of_kilted_is_moved() {
    a_robot_is_moved_of("kilted");
}
