//! Bytes that are no message: cut short, with lengths beyond all memory, in another encapsulation, random.

use crate::outcome::run_with_both_nodes;

#[test]
fn malformed_goals_are_counted_and_the_next_good_one_is_arrived_at() {
    run_with_both_nodes("malformed", &["goal"]);
}

#[test]
fn malformed_joint_states_are_counted_and_the_good_ones_followed() {
    run_with_both_nodes("malformed", &["joint_state"]);
}

#[test]
fn malformed_commands_are_counted_and_the_servo_s_followed() {
    run_with_both_nodes("malformed", &["command"]);
}

#[test]
fn malformed_parameter_requests_are_passed_over_and_good_ones_answered() {
    run_with_both_nodes("malformed", &["parameters"]);
}

#[test]
fn malformed_service_requests_are_passed_over() {
    run_with_both_nodes("malformed", &["stop"]);
}
