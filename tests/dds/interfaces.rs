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

#[test]
fn a_jog_moves_the_arm_while_it_comes_and_its_bag_replays_to_the_bit() {
    let mut host = Host::with_both_nodes();
    let (_directory, bag) = place();
    host.start("recorder", &["record", "-o", bag.to_str().unwrap()]);
    crate::record::wait_for(&bag, "/joint_states", 0.0);
    host.peer(&["jog"]);
    assert_eq!(host.interrupt("recorder").0, Some(0));
    assert!(assert_replays(&bag) > 500);
}

#[test]
fn a_robot_with_delays_encoders_and_lag_is_brought_to_its_goal() {
    let mut host = Host::new();
    let robot = [
        "command_latency:=0.01",
        "state_latency:=0.01",
        "velocity_time_constant:=0.02",
        "position_noise:=1e-5",
        "encoder_resolution:=5e-5",
        "state_rate:=125.0",
    ];
    let parameters = robot.iter().flat_map(|value| ["-p", value]);
    host.start("plant", &["puma560", "--ros-args"].into_iter().chain(parameters).collect::<Vec<_>>());
    let servo = host.start("servo", &["servo"]);
    wait_for_line(servo, "waiting_for_state -> holding");
    assert_success(&host.run(&["goal", "-0.125", "0.2", "0.2", "0", "0", "0", "1"]));
}
