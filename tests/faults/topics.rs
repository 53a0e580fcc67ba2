//! Others on the servo's topics.

use crate::outcome::run_with_both_nodes;

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
