//! Servo and plant killed, frozen, restarted, stopped.

use crate::host::Host;
use crate::outcome::{run, run_with_both_nodes};

#[test]
fn a_servo_killed_in_motion_leaves_a_plant_that_stops_by_its_own_timeout() {
    let host = Host::with_both_nodes();
    run(&host, "kill", &[&host.pid("servo").to_string()]);
}

#[test]
fn a_plant_killed_in_motion_and_started_again_is_followed_from_where_it_is() {
    let mut host = Host::with_both_nodes();
    run(&host, "plant_gone", &[&host.pid("plant").to_string()]);
    host.start("plant again", &["puma560"]);
    run(&host, "plant_back", &[]);
}

#[test]
fn a_frozen_servo_lets_the_plant_stop_and_makes_up_for_no_cycle() {
    let host = Host::with_both_nodes();
    run(&host, "frozen_process", &[&host.pid("servo").to_string(), "overruns"]);
}

#[test]
fn a_frozen_plant_stops_the_servo_until_it_goes_on() {
    let host = Host::with_both_nodes();
    run(&host, "frozen_process", &[&host.pid("plant").to_string(), "stale_state"]);
}

#[test]
fn a_plant_reset_in_motion_is_followed_from_its_start() {
    run_with_both_nodes("reset_in_motion", &[]);
}

#[test]
fn stop_in_motion_is_followed_by_zeros_until_another_goal() {
    run_with_both_nodes("stop_in_motion", &[]);
}

#[test]
fn pause_in_motion_is_followed_by_zeros_until_it_ends() {
    run_with_both_nodes("pause_in_motion", &[]);
}
