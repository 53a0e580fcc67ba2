//! Joint states that are bad, late, odd or not there. The peer plays the robot.

use crate::host::Host;
use crate::outcome::{check_memory, run};

fn robot(case: &str, arguments: &[&str]) {
    let host = Host::with_servo();
    run(&host, case, arguments);
    check_memory(&host, &["servo"]);
}

#[test]
fn joint_states_that_cease_stop_the_arm_until_they_come_again() {
    robot("stale", &["silent"]);
}

#[test]
fn joint_states_that_never_change_are_an_arm_that_does_not_follow() {
    robot("never_change", &[]);
}

#[test]
fn joint_states_delayed_by_40_ms_are_followed() {
    robot("taken", &["Delayed", "10"]);
}

#[test]
fn joint_states_reordered_with_older_stamps_are_followed() {
    robot("taken", &["Reordered"]);
}

#[test]
fn joint_states_in_another_order_are_followed() {
    robot("taken", &["other_order"]);
}

#[test]
fn joint_states_with_extra_joints_are_followed() {
    robot("taken", &["extra_joints"]);
}

#[test]
fn joint_states_stamped_by_a_clock_set_back_are_followed() {
    robot("taken", &["ClockBack"]);
}

#[test]
fn joint_states_with_a_joint_missing_are_rejected_and_stop_the_arm() {
    robot("stale", &["missing_joint", "not in the joint state"]);
}

#[test]
fn joint_states_with_nan_are_rejected_and_stop_the_arm() {
    robot("stale", &["nan", "finite"]);
}

#[test]
fn joint_states_with_infinities_are_rejected_and_stop_the_arm() {
    robot("stale", &["infinite", "finite"]);
}

#[test]
fn joint_states_with_empty_arrays_are_rejected_and_stop_the_arm() {
    robot("stale", &["empty", "not in the joint state"]);
}

#[test]
fn joint_states_with_names_alone_are_rejected_and_stop_the_arm() {
    robot("stale", &["names_without_positions", "with 0 positions"]);
}

#[test]
fn joint_states_of_100_000_other_joints_are_rejected() {
    robot("huge", &["0"]);
}

#[test]
fn joint_states_of_a_million_joints_are_refused_before_they_are_decoded_to_the_end() {
    robot("million", &[]);
}

#[test]
fn joint_states_of_100_000_joints_with_the_arm_s_among_them_are_taken() {
    robot("huge", &["1"]);
}

#[test]
fn joint_states_of_a_gripper_on_the_same_topic_change_nothing() {
    robot("gripper", &[]);
}

#[test]
fn joint_states_from_two_publishers_make_the_arm_stand_and_name_both() {
    robot("two_robots", &[]);
}
