//! Tests joint states that are invalid, late, odd or missing. The peer acts as the robot.

use crate::host::Host;
use crate::outcome::{cases, check_memory, run};

fn robot(case: &str, arguments: &[&str]) {
    let host = Host::with_servo();
    run(&host, case, arguments);
    check_memory(&host, &["servo"]);
}

cases! {
    robot:
    joint_states_that_cease_stop_the_arm_until_they_come_again => "stale" ["silent"];
    joint_states_that_cannot_be_are_rejected_and_stop_the_arm => "stale" ["nan", "finite"];
    joint_states_that_cease_end_the_hold_of_the_integral_within_the_limits => "held" [];
    joint_states_that_are_odd_are_followed => "odd" [];
    joint_states_that_never_change_are_an_arm_that_does_not_follow => "never_change" [];
    joint_states_of_a_million_joints_are_refused_before_they_are_decoded_to_the_end => "million" [];
    joint_states_of_100_000_joints_are_taken_where_the_arm_s_are_among_them => "huge" [];
    joint_states_of_a_gripper_on_the_same_topic_change_nothing => "gripper" [];
    joint_states_from_two_publishers_make_the_arm_stand_and_name_both => "two_robots" [];
}
