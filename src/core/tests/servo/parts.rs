//! Tests of an arm whose joint states come in several messages: on one topic, from one driver or from two.

use crate::rig::{Rig, state_of};
use dq_core::servo::{Rejection, State, StateError};

/// Sends the servo a joint state of the publisher `source`. The joint state contains the joints from `first` up to, but not including,
/// `end`, counted from 0.
fn part(rig: &mut Rig, (first, end): (usize, usize), source: u32) -> Result<bool, Rejection> {
    let names = rig.names[first..end].to_vec();
    let positions = rig.positions()[first..end].to_vec();
    let reading = state_of(&names, &positions, source);
    rig.take_state(0, &reading)
}

/// Returns a rig that sends no joint states, so that the tests can send them.
fn rig() -> Rig {
    let mut rig = Rig::new();
    rig.connect(false);
    rig
}

#[test]
fn rule_2_the_newest_of_each_joint_counts_and_the_arm_arrives() {
    let mut rig = rig();
    for cycle in 0..6000 {
        let _ = part(&mut rig, (0, 2), 1);
        // The arm's driver sends less often.
        if cycle % 4 == 0 {
            let _ = part(&mut rig, (2, 6), 2);
        }
        if cycle == 100 {
            rig.goal("theta_desired");
        }
        rig.cycle();
    }
    assert_eq!(rig.state(), State::Settled);
}

#[test]
fn rule_2_a_joint_that_never_comes_is_named() {
    let mut rig = rig();
    for _ in 0..200 {
        let taken = part(&mut rig, (0, 5), 1);
        assert!(
            matches!(taken, Err(Rejection::State(StateError::MissingJoint { ref joint, .. })) if joint == "joint6")
        );
        rig.cycle();
    }
    assert_eq!(rig.state(), State::WaitingForState);
}

#[test]
fn rule_2_a_part_that_falls_silent_is_a_robot_that_is_not_heard() {
    let mut rig = rig();
    for cycle in 0..400 {
        let taken = part(&mut rig, (2, 6), 2);
        if cycle < 200 {
            let _ = part(&mut rig, (0, 2), 1);
        }
        rig.cycle();
        if cycle > 300 {
            assert!(
                matches!(taken, Err(Rejection::State(StateError::MissingJoint { ref joint, .. })) if joint == "joint1")
            );
        }
    }
    assert_eq!(rig.state(), State::StaleState);
}

#[test]
fn rule_16_two_publishers_of_one_joint_are_rivals_in_parts_too() {
    let mut rig = rig();
    for _ in 0..300 {
        for (joints, source) in [((0, 2), 1), ((2, 6), 2), ((1, 2), 3)] {
            let _ = part(&mut rig, joints, source);
        }
        rig.cycle();
    }
    assert_eq!(rig.state(), State::Holding);
    assert!(rig.servo.status().reason.is_some());
}
