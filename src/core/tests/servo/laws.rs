//! Tests that each law reaches its goal, and that the laws behave as the reference work (Sathuluri 2018) says.

use crate::reference::pose;
use crate::rig::Rig;
use dq_algebra::UnitDualQuaternion;
use dq_core::servo::State;
use dq_kinematics::control::Law;

#[test]
fn every_law_arrives_and_says_so() {
    for law in Law::ALL {
        let mut rig = Rig::new();
        rig.set_law(law);
        rig.run(0.1);
        rig.goal("theta_desired");
        rig.run_until(State::Settled, 30.0);
        let figures = rig.servo.status().figures;
        assert!(figures.position_error <= 1e-3 && figures.rotation_error <= 1e-2, "{law}");
        assert!((figures.straight_line - 0.559).abs() < 2e-3 && figures.path_length >= figures.straight_line);
        assert!(figures.settling_time().unwrap() <= figures.arrival_time.unwrap(), "{law}");
    }
}

#[test]
fn another_law_leaves_a_settled_arm_settled() {
    let mut rig = Rig::new();
    rig.run(0.1);
    rig.goal("theta_desired");
    rig.run_until(State::Settled, 30.0);
    // At this distance, diffc moves the arm ten times faster than logc.
    rig.set_law(Law::Diffc);
    for _ in 0..500 {
        rig.cycle();
        assert_eq!(rig.state(), State::Settled);
    }
}

#[test]
fn logc_settles_as_the_reference_run_did() {
    let mut rig = Rig::new();
    rig.run(0.1);
    rig.goal("theta_desired");
    rig.run(12.0);
    let figures = rig.servo.status().figures;
    // An independent simulation found 3.9 s (rotation), 4.2 s (position), and joint speeds up to 2.5 rad/s.
    assert!((figures.settling_time_rotation.unwrap() - 3.9).abs() < 0.1, "{figures:?}");
    assert!((figures.settling_time_position.unwrap() - 4.2).abs() < 0.1, "{figures:?}");
    assert!((figures.peak_joint_speed - 2.5).abs() < 0.1, "{figures:?}");
}

#[test]
fn both_signs_of_a_goal_are_the_same_motion() {
    let goal = pose("theta_desired");
    let end = |goal: UnitDualQuaternion| {
        let mut rig = Rig::new();
        rig.set_law(Law::Diffc);
        rig.run(0.01);
        rig.goal_pose(&goal);
        rig.run(0.5);
        rig.plants[0].positions().to_vec()
    };
    let distance = crate::reference::distance(&end(goal), &end(-goal));
    assert!(distance < 1e-9, "{distance}");
}
