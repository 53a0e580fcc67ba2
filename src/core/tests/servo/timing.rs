//! Tests of rule 11 of the guide's safety page: late cycles.

use crate::rig::{PERIOD, Rig};
use dq_core::servo::State;

#[test]
fn rule_11_while_cycles_are_missed_the_plant_stops_by_itself_and_then_the_motion_goes_on() {
    let mut rig = Rig::in_motion(0.5);
    let (before, speed) = (rig.plants[0].positions().to_vec(), rig.speed());
    rig.cycle_late(450);
    // During the missed 0.9 s, the plant moved for its timeout of 0.1 s; then it moved for the late cycle.
    let moved = crate::reference::distance(&before, rig.plants[0].positions());
    let most = (speed + 0.1) * (0.1 + 2.0 * PERIOD.as_secs_f64());
    assert!(moved > 0.0 && moved <= most, "{moved} of {most}");
    rig.run_until(State::Settled, 30.0);
}

#[test]
fn rule_11_time_that_stands_still_or_goes_back_is_no_progress_and_no_harm() {
    let mut rig = Rig::in_motion(0.2);
    rig.now -= 50 * PERIOD;
    rig.cycle();
    assert_eq!(rig.state(), State::Tracking);
    rig.run_until(State::Settled, 30.0);
}
