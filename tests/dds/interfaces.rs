//! Arms that take positions or trajectories: driven, recorded and replayed.

use crate::host::{Host, assert_success, wait_for_line};
use crate::replay::{assert_replays, place};

/// A motion there, of an arm that takes such commands: how many of them are replayed to the bit.
fn there(interface: &str) -> u64 {
    let mut host = Host::new();
    let interface = ["--ros-args", "-p", &format!("command_interface:={interface}")].map(str::to_owned);
    let interface: Vec<_> = interface.iter().map(String::as_str).collect();
    host.start("plant", &[&["puma560"], &interface[..]].concat());
    let servo = host.start("servo", &[&["servo"], &interface[..]].concat());
    wait_for_line(servo, "waiting_for_state -> holding");
    let (_directory, bag) = place();
    let goal = ["goal", "-0.125", "0.2", "0.2", "0", "0", "0", "1", "--record", bag.to_str().unwrap()];
    assert_success(&host.run(&goal));
    assert_replays(&bag)
}

#[test]
fn an_arm_that_takes_positions_arrives_and_its_bag_replays_to_the_bit() {
    assert!(there("position") > 1000);
}

#[test]
fn an_arm_that_takes_trajectories_arrives_and_its_bag_replays_to_the_bit() {
    assert!(there("trajectory") > 200);
}
