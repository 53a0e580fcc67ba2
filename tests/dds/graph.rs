//! Tests that other nodes see our nodes as they see a node of rclcpp.

use crate::PEER;
use crate::host::{FAR, Host, PYTHON, wait_for_line, wait_until};
use std::io::{BufRead, BufReader};
use std::process::{Child, Stdio};

/// Starts a case of the peer. The peer prints a line when it listens.
fn listener(host: &Host, case: &str) -> Child {
    let mut peer = host.command(PYTHON).args([PEER, case]).stdout(Stdio::piped()).spawn().unwrap();
    let mut line = String::new();
    BufReader::new(peer.stdout.as_mut().unwrap()).read_line(&mut line).unwrap();
    assert_eq!(line, "listening\n");
    peer
}

#[test]
fn a_goal_reaches_all_earlier_subscribers() {
    let host = Host::with_both_nodes();
    let mut listeners: Vec<_> = (0..3).map(|_| listener(&host, "hear_goal")).collect();
    host.output(&FAR);
    for listener in &mut listeners {
        assert!(listener.wait().unwrap().success());
    }
}

#[test]
fn logs_and_parameter_events_are_offered_as_rclcpp_does() {
    Host::with_both_nodes().peer(&["as_rclcpp"]);
}

#[test]
fn types_are_described_to_clients_of_both_vendors() {
    Host::with_servo().peer(&["describe_types"]);
}

#[test]
fn a_description_that_fits_no_packet_is_answered() {
    let mut host = Host::new();
    // The addresses of this interface are not on loopback, so RustDDS keeps its packets as short as on Ethernet.
    host.shell("ip link add e0 type veth peer name e1 && ip addr add 10.7.0.1/24 dev e0 && ip link set e0 up && ip link set e1 up");
    wait_for_line(host.start("servo", &["servo"]), "waiting for joint states");
    host.peer(&["describe_types_over_ethernet"]);
}

#[test]
fn the_joint_states_of_a_best_effort_publisher_are_received() {
    let mut host = Host::new();
    host.start_peer(&["best_effort_robot"]);
    let servo = host.start("servo", &["servo"]);
    wait_for_line(servo, "publishes BEST_EFFORT only");
    wait_until(|| host.output(&["status"]).contains("holding").then_some(()));
}

#[test]
fn a_goal_reports_why_no_joint_states_arrive() {
    let mut host = Host::new();
    host.start_peer(&["best_effort_robot"]);
    let reliable = ["servo", "--ros-args", "-p", "reliability:=reliable"];
    wait_for_line(host.start("servo", &reliable), "/joint_states is not heard from");
    let output = host.run(&FAR);
    let why = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1));
    assert!(why.contains("offers BEST_EFFORT, this node asks for RELIABLE"), "{why}");
    assert!(why.contains("set reliability to auto"), "{why}");
}

#[test]
fn log_switches_do_what_they_say() {
    let mut host = Host::new();
    let folder = tempfile::tempdir().unwrap();
    let switches = [
        "servo",
        "--ros-args",
        "--disable-stdout-logs",
        "--disable-rosout-logs",
        "--enable-external-lib-logs",
    ];
    host.start_with("servo", &switches, &[("ROS_LOG_DIR", folder.path().to_str().unwrap())]);
    let logged = || {
        let files = folder.path().read_dir().unwrap().flatten();
        files.filter_map(|file| std::fs::read_to_string(file.path()).ok()).collect::<String>()
    };
    wait_until(|| logged().contains("waiting for joint states").then_some(()));
    assert_eq!(host.interrupt("servo").0, Some(0));
    assert_eq!(host.errors("servo"), "");
}
