//! Tests that only stamps follow `/clock`.

use crate::host::Host;

#[test]
fn stamps_follow_a_clock_that_jumps_stops_and_goes_back_while_the_arm_goes_to_its_goal() {
    let simulated = ["--ros-args", "-p", "use_sim_time:=true"];
    Host::with_nodes(&simulated, &simulated).peer(&["simulated_time"]);
}
