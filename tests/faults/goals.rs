//! Goals that are bad, out of reach, or too many.

use crate::outcome::run_with_both_nodes;

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
fn a_goal_in_an_unknown_frame_is_rejected_and_the_last_good_one_arrived_at() {
    run_with_both_nodes("bad_goal", &["frame"]);
}

#[test]
fn a_goal_beyond_reach_is_reported_and_stalls() {
    run_with_both_nodes("beyond_reach", &[]);
}

#[test]
fn a_thousand_goals_a_second_break_no_limit_and_the_last_is_arrived_at() {
    run_with_both_nodes("goal_flood", &[]);
}
