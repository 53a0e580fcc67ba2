//! Tests that only stamps follow `/clock`.

use crate::commands::err;
use crate::host::{Host, assert_success};
use std::process::Output;

#[test]
fn stamps_follow_a_clock_that_jumps_stops_and_goes_back_while_the_arm_goes_to_its_goal() {
    let simulated = ["--ros-args", "-p", "use_sim_time:=true"];
    Host::with_nodes(&simulated, &simulated).peer(&["simulated_time"]);
}

#[test]
fn a_goal_in_a_frame_has_the_time_of_the_servo() {
    let simulated = ["--ros-args", "-p", "use_sim_time:=true"];
    let mut host = Host::with_nodes(&simulated, &simulated);
    host.start_peer(&["simulated_table"]);
    let goal = ["goal", "-0.225", "0.2", "0.2", "--rpy", "0", "0", "0", "--frame", "table"];
    // The frame `table` becomes known some time after its publisher has started.
    let is_unknown = |output: &Output| err(output).contains("TF has no frame");
    let went = (0..20).map(|_| host.run(&goal)).find(|output| !is_unknown(output)).unwrap();
    assert_success(&went);
}
