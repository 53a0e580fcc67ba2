//! A cycle allocates no memory once it has run for a while in its state.

use crate::rig::Rig;
use dq_algebra::UnitDualQuaternion;
use dq_core::servo::{Interface, State};
use dq_kinematics::control::{Aim, Controller, Law, Map};
use nalgebra::Vector3;

/// How long the servo is in a state before the test counts allocations \[s\]. By then all windows of the monitors are full.
const WARM: f64 = 0.5;

fn count(rig: &mut Rig, what: &str, seconds: f64) {
    rig.run(WARM);
    rig.allocations = 0;
    rig.run(seconds);
    assert_eq!(rig.allocations, 0, "{what}: {:?}", rig.servo.status());
}

#[test]
fn a_cycle_that_pursues_a_goal_by_any_law_allocates_nothing() {
    for (law, jerk) in Law::ALL.into_iter().zip([f64::INFINITY, 1e3].into_iter().cycle()) {
        for interface in Interface::NAMES {
            let mut rig = Rig::with(|settings| {
                settings.interface = interface.parse().unwrap();
                settings.controller.law = law;
                settings.limits.joint_jerk.fill(jerk);
            });
            count(&mut rig, "holding", 1.0);
            rig.goal("theta_desired");
            count(&mut rig, &format!("{law} {interface}"), 5.0);
        }
    }
}

#[test]
fn a_cycle_at_rest_or_without_its_robot_allocates_nothing() {
    let mut rig = Rig::new();
    rig.goal("theta_desired");
    rig.run_until(State::Settled, 20.0);
    count(&mut rig, "settled", 1.0);
    rig.pause(true);
    count(&mut rig, "paused", 1.0);
    rig.pause(false);
    rig.following = false;
    rig.goal("theta_initial");
    count(&mut rig, "an arm that does not follow", 2.0);
    rig.connect(false);
    count(&mut rig, "stale", 2.0);
}

#[test]
fn a_cycle_that_jogs_allocates_nothing() {
    let mut rig = Rig::new();
    rig.run(0.1);
    for cycle in 0..1000 {
        let take = || rig.twist([0.0, 0.0, 0.05], [0.0; 3], "base_link").unwrap();
        let taken = allocation_counter::measure(take).count_total;
        rig.cycle();
        if cycle == 200 {
            rig.allocations = 0;
        }
        assert!(cycle < 200 || taken + rig.allocations == 0, "{taken} {}", rig.allocations);
    }
    assert_eq!(rig.state(), State::Jogging);
}

#[test]
fn a_cycle_of_two_arms_allocates_nothing() {
    for aim in Aim::ALL {
        for map in [Map::Transpose, Map::DampedInverse] {
            let mut rig = Rig::two_arms();
            rig.change(|settings| {
                settings.controller = Controller::of_two_arms(map, aim, 2.0, settings.controller.damping);
            });
            count(&mut rig, "holding", 0.5);
            let (here, way) = (rig.servo.pose().unwrap(), Vector3::new(0.1, 0.05, 0.0));
            rig.goal_pose(&UnitDualQuaternion::from_parts(here.rotation(), here.translation() + way));
            count(&mut rig, &format!("{aim} {map}"), 2.0);
        }
    }
}
