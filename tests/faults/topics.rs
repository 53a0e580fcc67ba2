//! Others on the servo's topics.

use crate::host::{Host, wait_for_line};
use crate::outcome::{run, run_with_both_nodes};

#[test]
fn two_publishers_of_commands_are_reported_by_servo_and_plant() {
    run_with_both_nodes("rival", &[]);
}

#[test]
fn a_frozen_subscriber_of_commands_holds_up_nobody() {
    run_with_both_nodes("bad_subscriber", &["frozen"]);
}

#[test]
fn a_subscriber_of_commands_that_never_reads_holds_up_nobody() {
    run_with_both_nodes("bad_subscriber", &["never_read"]);
}

#[test]
fn a_hundred_changes_of_parameters_a_second_make_no_step() {
    run_with_both_nodes("parameters", &[]);
}

#[test]
fn a_forgotten_simulator_beside_the_robot_is_named_and_the_arm_stands() {
    let mut host = Host::with_both_nodes();
    host.start("simulator", &["puma560", "--ros-args", "-r", "__node:=forgotten"]);
    run(&host, "two_plants", &[]);
}

#[test]
fn commands_that_nobody_subscribes_to_are_reported_at_once() {
    let mut host = Host::new();
    let elsewhere = "forward_velocity_controller/commands:=elsewhere";
    host.start("plant", &["puma560", "--ros-args", "-r", elsewhere]);
    host.start("servo", &["servo"]);
    host.start("goal", &["goal", "-0.125", "0.2", "0.2", "0", "0", "0", "1", "--timeout", "30"]);
    let said = "nobody subscribes to /forward_velocity_controller/commands";
    wait_for_line(host.child("servo"), said);
}
