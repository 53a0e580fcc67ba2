//! Tests hosts in different networks, and networks that come late.

use crate::described::wait_for_text;
use crate::host::{FAR, FAST, Host, wait_for_line};
use crate::routed::Routed;
use std::fs::File;

#[test]
fn an_arm_behind_a_router_is_moved_if_both_sides_are_in_ros_static_peers() {
    let mut hosts = Routed::new();
    hosts.plant_side.start_with("plant", &["puma560"], &[("ROS_STATIC_PEERS", "10.77.1.2")]);
    let peers = [("ROS_STATIC_PEERS", "nobody.invalid; 10.77.2.2")];
    let servo = [&["servo"], &FAST[..]].concat();
    wait_for_line(hosts.servo_side.start_with("servo", &servo, &peers), "waiting_for_state -> holding");
    // The plant learns that the servo leaves, so that the next one is the only publisher of commands.
    assert_eq!(hosts.servo_side.interrupt("servo").0, Some(0));
    wait_for_line(hosts.servo_side.start_with("servo", &servo, &peers), "waiting_for_state -> holding");
    hosts.servo_side.output(&FAR);
    assert_eq!(hosts.plant_side.interrupt("plant").0, Some(0));
    let log = hosts.plant_side.errors("plant");
    assert!(!log.contains("publishers on"), "{log}");
}

#[test]
fn a_servo_started_before_the_network_ends_when_that_comes_and_then_meets_its_robot() {
    let mut hosts = Routed::new();
    let host = &mut hosts.servo_side;
    host.shell("ip address del 10.77.1.2/24 dev eth0");
    let waiting = wait_for_servo(host);
    host.shell("ip address add 10.77.1.2/24 dev eth0");
    assert_eq!(host.wait("servo"), Some(4));
    let log = std::fs::read_to_string(waiting).unwrap();
    assert!(log.contains("error: this host has the new address 10.77.1.2"), "{log}");
    // Started again, it meets the robot, and then goes on if another network comes.
    host.start("plant", &["puma560"]);
    let moving = wait_for_servo(host);
    wait_for_text(&moving, "waiting_for_state -> holding");
    host.shell("ip address add 10.78.0.2/24 dev eth0");
    wait_for_text(&moving, "this host has the new address 10.78.0.2");
    host.output(&FAR);
    assert_eq!(host.interrupt("servo").0, Some(0));
}

/// Starts a servo, and waits until it waits for joint states. Returns the path of its log.
fn wait_for_servo(host: &mut Host) -> String {
    let log = host.file("servo.log", "");
    host.start_logging_to("servo", &[&["servo"], &FAST[..]].concat(), File::create(&log).unwrap());
    wait_for_text(&log, "waiting for joint states");
    log
}

#[test]
fn variables_that_are_not_obeyed_are_warned_of_once() {
    let mut host = Host::new();
    let variables = [("RMW_IMPLEMENTATION", "rmw_zenoh_cpp"), ("ROS_DISCOVERY_SERVER", "10.0.0.5:11811")];
    let servo = host.start_with("servo", &["servo"], &variables);
    wait_for_line(servo, "RMW_IMPLEMENTATION=rmw_zenoh_cpp: this program speaks DDS");
    host.signal("servo", "INT");
    assert_eq!(host.wait("servo"), Some(0));
}

#[test]
fn a_host_with_many_networks_uses_those_that_lead_to_others() {
    let mut host = Host::without_network();
    host.shell(
        "ip link set lo up && for i in 0 1 2 3 4 5 6; do
            ip link add net$i type veth peer name far$i && ip address add 10.79.$i.2/24 dev net$i &&
            ip link set net$i up && ip link set far$i up; done && ip route add default via 10.79.0.1",
    );
    host.start("plant", &["puma560"]);
    let log = host.file("servo.log", "");
    host.start_logging_to("servo", &[&["servo"], &FAST[..]].concat(), File::create(&log).unwrap());
    wait_for_text(&log, "7 network interfaces: net0 used, net1, net2, net3, net4, net5, net6 left out");
    wait_for_text(&log, "waiting_for_state -> holding");
    host.output(&FAR);
    // With all interfaces, each of them sends thousands of packets in this time.
    host.shell("test $(ip -s link show net3 | awk '/TX:/ { getline; print $2 }') -lt 100");
    host.shell("test $(ip -s link show net0 | awk '/TX:/ { getline; print $2 }') -gt 100");
}
