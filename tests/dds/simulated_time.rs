//! `/clock`: stamps follow it, nothing else does.

use crate::host::{Host, wait_for_line};

#[test]
fn stamps_follow_a_clock_that_jumps_stops_and_goes_back_while_the_arm_goes_to_its_goal() {
    let mut host = Host::new();
    let simulated = ["--ros-args", "-p", "use_sim_time:=true"];
    host.start("plant", &[&["puma560"], &simulated[..]].concat());
    let servo = host.start("servo", &[&["servo"], &simulated[..]].concat());
    wait_for_line(servo, "waiting_for_state -> holding");
    host.peer(&["simulated_time"]);
}
