//! Tests goals that are invalid, out of reach, or too many, and messages that are not goals.

use crate::host::Host;
use crate::outcome::{cases, run, run_with_both_nodes};

cases! {
    run_with_both_nodes:
    malformed_messages_and_requests_are_counted_and_good_ones_obeyed => "malformed" [];
    bad_goals_are_rejected_by_their_kinds_and_the_last_good_one_arrived_at => "bad_goals" [];
    a_bad_goal_does_not_hide_the_good_one_before_it => "bad_after_good" [];
    a_frame_of_10_mb_and_names_of_100_kb_are_cut_and_the_last_good_goal_arrived_at => "long_text" [];
    the_measured_pose_fed_back_as_the_goal_moves_the_arm_slowly => "fed_back" [];
    a_goal_beyond_reach_is_reported_and_stalls => "beyond_reach" [];
    a_thousand_goals_a_second_break_no_limit_and_the_last_is_arrived_at => "goal_flood" [];
}

/// Runs a case with servo and plant. The servo has these parameters.
fn run_with_parameters(parameters: &[&str], case: &str) {
    run(&Host::with_nodes(&[], &[&["--ros-args"], parameters].concat()), case, &[]);
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
