//! Tests nodes on Fast DDS (peer.cpp) with servo and plant.

use crate::host::{Host, assert_success, wait_for_line};
use dq_bags::{Bag, BagMessage};
use dq_messages::messages::PoseStamped;
use std::time::Duration;

/// The peer, which tests/install.sh builds.
const PEER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/target/peers/stock");

fn run(host: &Host, case: &[&str]) {
    assert_success(&host.command("timeout").args(["120", PEER]).args(case).output().unwrap());
}

#[test]
fn no_goal_of_a_publisher_that_leaves_at_once_is_lost() {
    let host = Host::with_both_nodes();
    run(&host, &["goals", "200"]);
    run(&host, &["taken", "200"]);
}

#[test]
fn a_subscriber_that_joins_a_running_publisher_loses_and_duplicates_nothing() {
    let mut host = Host::new();
    let folder = tempfile::tempdir().unwrap();
    let bag = folder.path().join("bag");
    let mut stream = host.command("timeout").args(["120", PEER, "stream", "4"]).spawn().unwrap();
    // Some goals are sent before the recorder starts.
    std::thread::sleep(Duration::from_secs(1));
    host.start("recorder", &["record", "--out", bag.to_str().unwrap(), "--topics", "/goal_pose"]);
    assert!(stream.wait().unwrap().success());
    assert_eq!(host.interrupt("recorder").0, Some(0));
    let number = |message: BagMessage| message.decode::<PoseStamped>().unwrap().header.stamp.sec;
    let numbers: Vec<i32> = Bag::open(&bag).unwrap().map(number).collect();
    let (first, last) = (numbers[0], numbers[numbers.len() - 1]);
    assert!(first > 100 && last >= 790, "from {first} to {last}");
    assert_eq!(numbers, (first..=last).collect::<Vec<_>>());
}

#[test]
fn an_incompatible_publisher_is_named_in_rosout_with_the_remedy() {
    let mut host = Host::new();
    let reliable = ["servo", "--ros-args", "-p", "reliability:=reliable"];
    wait_for_line(host.start("servo", &reliable), "waiting for joint states");
    run(&host, &["warned", "-"]);
}

/// Returns two hosts with a cable between them.
fn connected() -> [Host; 2] {
    let servo_side = Host::new();
    let user_side = servo_side.beside();
    let pid = user_side.namespace_pid();
    servo_side.shell(&format!("ip link add eth0 mtu 1500 type veth peer name eth0 mtu 1500 netns {pid}"));
    for (host, number) in [(&servo_side, 1), (&user_side, 2)] {
        host.shell(&format!("ip address add 10.78.0.{number}/24 dev eth0 && ip link set lo up"));
        host.shell("ip link set eth0 up && ip route replace 224.0.0.0/4 dev eth0");
    }
    [servo_side, user_side]
}

#[test]
fn replies_of_any_length_reach_another_host_once() {
    let [mut servo_side, user_side] = connected();
    wait_for_line(servo_side.start("servo", &["servo"]), "waiting for joint states");
    run(&user_side, &["replies", "20"]);
}
