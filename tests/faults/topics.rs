//! Tests other publishers and subscribers on the servo's topics.

use crate::host::{FAR, FAST, Host, wait_for_line};
use crate::outcome::{check_memory, run, run_at, run_with_both_nodes};

#[test]
fn two_publishers_of_commands_are_reported_by_servo_and_plant() {
    run_with_both_nodes("rival", &[]);
}

/// The servo runs as fast as possible. A frozen process counts as gone after 10 s, and must miss enough samples within this time.
#[test]
fn a_frozen_subscriber_of_commands_and_one_that_never_reads_delay_no_other() {
    let host = Host::with_nodes(&[], &[&FAST[..], &["-p", "update_rate:=2000"]].concat());
    run_at(2000, &host, "bad_subscribers", &[]);
    check_memory(&host, &["servo", "plant"]);
}

#[test]
fn a_hundred_changes_of_parameters_a_second_make_no_step() {
    run_with_both_nodes("parameters", &[]);
}

#[test]
fn two_servos_never_drive_one_arm_together_and_both_are_named() {
    let mut host = Host::with_both_nodes();
    host.start_servo("other", &["--ros-args", "-r", "__node:=other"]);
    let commands = tempfile::NamedTempFile::new().unwrap();
    host.peer(&["two_servos", commands.path().to_str().unwrap()]);
}

#[test]
fn a_forgotten_simulator_beside_the_robot_is_named_and_the_arm_stops() {
    let mut host = Host::with_both_nodes();
    host.start("simulator", &["puma560", "--ros-args", "-r", "__node:=forgotten"]);
    run(&host, "two_plants", &[]);
}

#[test]
fn commands_that_nobody_but_a_guard_subscribes_to_are_reported_at_once() {
    let mut host = Host::new();
    let elsewhere = "forward_velocity_controller/commands:=elsewhere";
    host.start("plant", &["puma560", "--ros-args", "-r", elsewhere]);
    wait_for_line(host.start("guard", &["guard"]), "watching /");
    host.start("servo", &["servo"]);
    host.start("goal", &[&FAR[..], &["--timeout", "30"]].concat());
    wait_for_line(host.child("servo"), "nobody subscribes to /forward_velocity_controller/commands");
}
