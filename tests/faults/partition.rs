//! Servo and plant on two hosts with a bad network between them.

use crate::host::wait_for_line;
use crate::network::{Impairment, Network};
use crate::outcome::{check_memory, run};

/// Servo here, plant there, as soon as they have found each other.
fn with_nodes(impairment: &Impairment) -> Network {
    let mut network = Network::new(impairment);
    network.plant_side.start("plant", &["puma560"]);
    let servo = network.servo_side.start("servo", &["servo"]);
    wait_for_line(servo, "waiting_for_state -> holding");
    network
}

fn arrives(impairment: &Impairment) {
    let network = with_nodes(impairment);
    run(&network.servo_side, "arrive", &[]);
    check_memory(&network.servo_side, &["servo"]);
    check_memory(&network.plant_side, &["plant"]);
}

#[test]
fn a_tenth_of_packets_lost_it_arrives() {
    arrives(&Impairment { loss: 0.1, ..Impairment::default() });
}

#[test]
fn packets_late_and_out_of_order_it_arrives() {
    arrives(&Impairment { delay: 0.02, jitter: 0.01, ..Impairment::default() });
}

#[test]
fn a_fifth_of_packets_twice_it_arrives() {
    arrives(&Impairment { duplicate: 0.2, ..Impairment::default() });
}

#[test]
fn lost_late_and_doubled_at_once_it_arrives() {
    arrives(&Impairment { loss: 0.05, delay: 0.01, jitter: 0.005, duplicate: 0.05 });
}

#[test]
fn a_goal_that_was_sent_while_the_cable_was_out_moves_nothing_when_it_comes() {
    let mut network = Network::new(&Impairment::default());
    network.servo_side.start("plant", &["puma560"]);
    wait_for_line(network.servo_side.start("servo", &["servo"]), "waiting_for_state -> holding");
    run(&network.plant_side, "cable_out", &[&network.relay_pid()]);
}

#[test]
fn a_partition_of_three_seconds_stops_the_arm_until_the_goal_comes_again() {
    let network = with_nodes(&Impairment::default());
    run(&network.servo_side, "partition", &[&network.relay_pid()]);
}
