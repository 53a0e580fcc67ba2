//! Tests servo and plant on two hosts with an impaired network between them.

use crate::host::FAST;
use crate::network::{Impairment, Network};
use crate::outcome::{check_memory, run};

/// Starts the servo on one host and the plant on the other, and waits until they have found each other.
fn with_nodes(impairment: &Impairment) -> Network {
    let mut network = Network::new(impairment);
    network.plant_side.start("plant", &["puma560"]);
    network.servo_side.start_servo("servo", &FAST);
    network
}

#[test]
fn the_arm_arrives_with_lost_late_reordered_and_duplicated_packets() {
    let network = with_nodes(&Impairment { loss: 0.05, delay: 0.01, jitter: 0.005, duplicate: 0.05 });
    run(&network.servo_side, "arrive", &[]);
    check_memory(&network.servo_side, &["servo"]);
    check_memory(&network.plant_side, &["plant"]);
}

#[test]
fn a_goal_that_was_sent_while_the_cable_was_out_moves_nothing_when_it_arrives() {
    let mut network = Network::new(&Impairment::default());
    network.servo_side.start("plant", &["puma560"]);
    network.servo_side.start_servo("servo", &FAST);
    run(&network.plant_side, "cable_out", &[&network.relay_pid()]);
}

#[test]
fn a_partition_of_three_seconds_stops_the_arm_until_the_goal_is_sent_again() {
    let network = with_nodes(&Impairment::default());
    run(&network.servo_side, "partition", &[&network.relay_pid()]);
}
