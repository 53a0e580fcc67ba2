//! Goals that are bad, out of reach, or too many.

use crate::host::{Host, wait_for_line};
use crate::outcome::{run, run_with_both_nodes};

#[test]
fn a_goal_with_a_zero_quaternion_is_rejected_and_the_last_good_one_arrived_at() {
    run_with_both_nodes("bad_goal", &["zero"]);
}

#[test]
fn a_goal_with_a_quaternion_that_is_not_unit_is_rejected_and_the_last_good_one_arrived_at() {
    run_with_both_nodes("bad_goal", &["not_unit"]);
}

#[test]
fn a_goal_with_nan_is_rejected_and_the_last_good_one_arrived_at() {
    run_with_both_nodes("bad_goal", &["nan"]);
}

#[test]
fn a_goal_at_infinity_is_rejected_and_the_last_good_one_arrived_at() {
    run_with_both_nodes("bad_goal", &["infinite"]);
}

#[test]
fn a_goal_at_1e308_is_rejected_and_the_last_good_one_arrived_at() {
    run_with_both_nodes("bad_goal", &["huge"]);
}

#[test]
fn a_goal_in_an_unknown_frame_is_rejected_and_the_last_good_one_arrived_at() {
    run_with_both_nodes("bad_goal", &["frame"]);
}

#[test]
fn a_bad_goal_does_not_hide_the_good_one_before_it() {
    run_with_both_nodes("bad_after_good", &[]);
}

#[test]
fn a_frame_of_10_mb_and_names_of_100_kb_are_cut_and_the_last_good_goal_arrived_at() {
    run_with_both_nodes("long_text", &[]);
}

#[test]
fn a_goal_beyond_reach_is_reported_and_stalls() {
    run_with_both_nodes("beyond_reach", &[]);
}

#[test]
fn a_thousand_goals_a_second_break_no_limit_and_the_last_is_arrived_at() {
    run_with_both_nodes("goal_flood", &[]);
}

/// Servo, with these parameters, and plant.
fn run_with_parameters(parameters: &[&str], case: &str) {
    let mut host = Host::new();
    host.start("plant", &["puma560"]);
    let servo = host.start("servo", &[&["servo", "--ros-args"], parameters].concat());
    wait_for_line(servo, "waiting_for_state -> holding");
    run(&host, case, &[]);
}

#[test]
fn a_goal_beyond_a_position_limit_is_reported_with_the_joint_and_stalls() {
    let lower = "limits.joint_position_lower:=[-9.0, -9.0, 1.6, -9.0, -9.0, -9.0]";
    run_with_parameters(&["-p", lower, "-p", "progress_timeout:=1.0"], "position_limit");
}

#[test]
fn a_stream_of_goals_that_ends_stops_the_arm() {
    run_with_parameters(&["-p", "goal_timeout:=0.5"], "stream");
}

#[test]
fn a_servo_without_a_robot_commands_nothing() {
    Host::with_servo().peer(&["no_robot", "/dev/null"]);
}
