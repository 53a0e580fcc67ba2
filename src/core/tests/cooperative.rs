//! Two arms that one servo controls.

use crate::reference::puma;
use crate::rig::{PERIOD, Rig};
use dq_algebra::UnitDualQuaternion;
use dq_core::servo::{Reason, Revocation, State};
use dq_kinematics::control::{Aim, Controller, Damping, Map};
use nalgebra::Vector3;

/// Returns a goal that is near the start, in position and orientation.
fn nearby(rig: &Rig) -> UnitDualQuaternion {
    let turn = UnitDualQuaternion::from_translation_angle_axis(
        Vector3::new(0.05, 0.08, -0.06),
        0.4,
        &Vector3::y_axis(),
    );
    rig.servo.pose().unwrap() * turn
}

#[test]
fn every_primitive_arrives_in_both_forms_within_the_limits() {
    for aim in Aim::ALL {
        for (map, gain) in [(Map::Transpose, 10.0), (Map::DampedInverse, 1.0)] {
            let damping = Damping { max: 0.05, threshold: 0.05 };
            let mut rig = Rig::two_arms();
            rig.change(|settings| settings.controller = Controller::of_two_arms(map, aim, gain, damping));
            rig.run(0.01);
            rig.goal_pose(&nearby(&rig));
            rig.run_until(State::Settled, 30.0);
            let figures = rig.servo.status().figures;
            assert!(figures.position_error <= 1e-3 && figures.rotation_error <= 1e-2, "{aim} {map}");
            assert!(figures.path_length > 1e-3 && rig.servo.smallest_singular_value() > 0.0);
        }
    }
}

#[test]
fn either_arm_silent_stops_both_and_is_known() {
    for silent in [0, 1] {
        let mut rig = Rig::two_arms();
        rig.connected[silent] = false;
        rig.take_point([0.1; 3], [0.0, 0.0, 0.0, 1.0], "left/tool0").unwrap();
        rig.run(0.2);
        assert_eq!((rig.state(), rig.speed()), (State::WaitingForState, 0.0));
        assert_eq!(rig.servo.quietest_arm(), silent);
        rig.connect(true);
        rig.run(0.01);
        rig.goal_pose(&nearby(&rig));
        rig.run(0.3);
        assert!(rig.speed() > 0.05);
        rig.connected[1 - silent] = false;
        rig.run(0.104);
        assert_eq!((rig.state(), rig.servo.quietest_arm()), (State::StaleState, 1 - silent));
        rig.run(0.1);
        assert_eq!(rig.speed(), 0.0);
        rig.connect(true);
        rig.run_until(State::Settled, 30.0);
    }
}

#[test]
fn another_primitive_moves_nothing_until_somebody_asks_for_that() {
    let mut rig = Rig::two_arms();
    rig.run(0.01);
    let goal = nearby(&rig);
    rig.goal_pose(&goal);
    rig.run_until(State::Settled, 30.0);
    rig.change(|settings| settings.controller.aim = Aim::Pose);
    rig.run(1.0);
    assert_eq!((rig.state(), rig.speed()), (State::Holding, 0.0));
    assert_eq!(rig.servo.status().reason, Some(Reason::Revoked(Revocation::AnotherAim)));
    rig.goal_pose(&goal);
    rig.cycle();
    assert_eq!(rig.state(), State::Tracking);
    assert_eq!(rig.servo.status().figures.arrival_time, None);
    // An arm in motion decelerates to rest.
    rig.run(0.1);
    assert!(rig.speed() > 0.0);
    rig.change(|settings| settings.controller.aim = Aim::Distance);
    rig.run(1.0);
    assert_eq!((rig.state(), rig.speed()), (State::Holding, 0.0));
}

#[test]
fn cartesian_limits_hold_for_both_tools() {
    let mut rig = Rig::two_arms();
    rig.change(|settings| settings.limits.linear_speed = 0.05);
    rig.run(0.01);
    rig.goal_pose(&nearby(&rig));
    let points = |rig: &Rig| {
        let tool = |arm: usize| puma().forward_kinematics(rig.plants[arm].positions()).unwrap().translation();
        [tool(0), tool(1)]
    };
    let mut last = points(&rig);
    let mut fastest = 0.0_f64;
    for _ in 0..500 {
        rig.cycle();
        let now = points(&rig);
        for arm in [0, 1] {
            fastest = fastest.max((now[arm] - last[arm]).norm() / PERIOD.as_secs_f64());
        }
        last = now;
    }
    assert!((0.04..0.0525).contains(&fastest), "{fastest}");
}
