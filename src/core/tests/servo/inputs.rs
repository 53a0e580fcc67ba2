//! Tests of rules 1 to 4 of the guide's safety page: inputs that are in time, late, or invalid.

use crate::reference::pose;
use crate::rig::{PERIOD, Rig, state_of};
use dq_core::servo::{BeyondReach, Event, GoalReading, JointReading, Reason, Rejection, Sent, Stall, State};
use dq_kinematics::control::Law;
use std::time::Duration;

#[test]
fn rule_1_nothing_moves_before_a_joint_state_and_a_goal() {
    let mut rig = Rig::new();
    rig.connect(false);
    rig.goal("theta_desired");
    rig.run(0.1);
    assert_eq!((rig.state(), rig.speed()), (State::WaitingForState, 0.0));
    let mut rig = Rig::new();
    rig.run(0.1);
    assert_eq!((rig.state(), rig.speed()), (State::Holding, 0.0));
}

#[test]
fn rule_2_stale_joint_states_stop_the_arm_within_one_timeout_and_fresh_ones_resume() {
    let mut rig = Rig::in_motion(0.5);
    assert!(rig.speed() > 0.5);
    rig.connect(false);
    rig.run(0.104);
    assert_eq!(rig.state(), State::StaleState);
    rig.run(0.1);
    assert_eq!(rig.speed(), 0.0);
    // Rule 15 revokes requests after a second.
    rig.run(0.7);
    rig.connect(true);
    rig.run_until(State::Settled, 30.0);
}

#[test]
fn rule_3_goals_are_latched_unless_a_timeout_makes_them_a_stream() {
    let mut rig = Rig::with(|settings| settings.goal_timeout = Some(Duration::from_millis(200)));
    rig.stream(&pose("theta_desired"));
    rig.run(0.19);
    assert_eq!(rig.state(), State::Tracking);
    rig.stream(&pose("theta_desired"));
    rig.run(0.19);
    assert_eq!(rig.state(), State::Tracking);
    rig.run(0.2);
    assert_eq!((rig.state(), rig.speed()), (State::StaleGoal, 0.0));
    assert_eq!(rig.servo.status().reason, Some(Reason::StreamEnded));
    assert_eq!(rig.servo.status().goal_count, 1, "the same goal again is no new motion");
}

#[test]
fn rule_4_bad_messages_are_rejected_counted_and_leave_the_last_good_ones() {
    let mut rig = Rig::in_motion(0.1);
    let before = rig.servo.status().goal;
    let unit = [0.0, 0.0, 0.0, 1.0];
    let now = rig.now;
    for (position, orientation, frame, label) in [
        ([f64::NAN, 0.0, 0.0], unit, "", "non_finite"),
        ([0.0; 3], [0.0, f64::INFINITY, 0.0, 1.0], "", "non_finite"),
        ([0.0; 3], [0.0; 4], "", "not_unit"),
        ([0.0; 3], [0.0, 0.0, 0.0, 1.006], "", "not_unit"),
        ([0.0; 3], [1e200; 4], "", "not_unit"),
        ([0.0; 3], unit, "map", "unknown_frame"),
    ] {
        let rejection = rig.take_point(position, orientation, frame).unwrap_err();
        assert_eq!(rejection.label(), label);
    }
    let names = rig.names.clone();
    let mut nan = vec![0.0; 6];
    nan[3] = f64::NAN;
    for (names, positions, label) in [
        (&names[..5], vec![0.0; 5], "missing_joint"),
        (&names[..], vec![0.0; 5], "wrong_length"),
        (&names[..], nan, "non_finite"),
        (&[][..], vec![], "missing_joint"),
    ] {
        let reading = state_of(names, &positions, 0);
        assert_eq!(rig.servo.take_joint_state(0, &reading, now).unwrap_err().label(), label);
    }
    let reading = state_of(&names, &[0.0; 6], 0);
    let rejection = rig.servo.take_joint_state(1, &reading, now).unwrap_err();
    assert_eq!(rejection, Rejection::UnknownArm { arm: 1, arms: 1 });
    rig.run(0.01);
    assert_eq!(rig.servo.status().goal, before);
    assert_eq!(rig.servo.rejections().total(), 11);
    assert_eq!(rig.servo.rejections().by_reason()[0], ("non_finite", 3));
    // A rounding error of the quaternion is allowed.
    rig.take_point([0.1; 3], [0.0, 0.0, 0.0, 1.0009], "/base_link").unwrap();
}

#[test]
fn joint_states_are_matched_by_name() {
    let mut rig = Rig::new();
    let mut names = rig.names.clone();
    names.reverse();
    names.push("gripper".to_owned());
    let mut positions = rig.plants[0].positions().to_vec();
    positions.reverse();
    positions.push(f64::NAN);
    let reading = JointReading { velocities: &[0.0; 7], ..state_of(&names, &positions, 0) };
    rig.servo.take_joint_state(0, &reading, rig.now).unwrap();
    rig.servo.step(rig.now);
    let expected = crate::reference::puma().forward_kinematics(rig.plants[0].positions()).unwrap();
    assert_eq!(rig.servo.pose(), Some(expected));
}

#[test]
fn a_goal_beyond_reach_is_rejected_unless_the_arm_may_go_as_near_as_it_can() {
    let mut rig = Rig::new();
    let refused = rig.take_point([3.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0], "").unwrap_err();
    assert!(
        refused.to_string().starts_with("the goal is 3.0") && refused.to_string().contains("reaches 0.88"),
        "{refused}"
    );
    rig.run(1.0);
    assert_eq!((rig.state(), rig.speed(), rig.servo.status().goal), (State::Holding, 0.0, None));
    rig.change(|settings| settings.beyond_reach = BeyondReach::Approach);
    rig.take_point([3.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0], "").unwrap();
    rig.run(2.0);
    assert!(rig.servo.status().goal_beyond_reach);
    rig.stop();
    rig.run(0.5);
    assert!(!rig.servo.status().goal_beyond_reach, "there is no goal any more");
}

/// A goal that is given in millimeters instead of meters may be hundreds of meters away. The commands of the law then swing.
#[test]
fn rule_9_a_goal_however_far_beyond_reach_is_told_with_both_distances() {
    for distance in [3.0, 10.0, 412.0] {
        for law in Law::ALL {
            let mut rig = Rig::with(|settings| {
                settings.controller.law = law;
                settings.beyond_reach = BeyondReach::Approach;
            });
            let [x, y, z] = [300.0, 200.0, 200.0].map(|part| part * distance / 412.3);
            rig.take_point([x, y, z], [0.0, 0.0, 0.0, 1.0], "").unwrap();
            rig.run_until(State::Stalled, 20.0);
            let Some(Stall::BeyondReach(reach)) = rig.servo.status().stall else {
                panic!("{law}, {distance} m: {:?}", rig.servo.status().stall)
            };
            assert!((reach.goal / distance - 1.0).abs() < 0.2 && reach.longest < 1.2, "{reach:?}");
        }
    }
}

#[test]
fn a_cycle_takes_what_comes_in_its_order_and_counts_what_is_no_message() {
    let mut rig = Rig::in_motion(0.5);
    let unusable = |what: &str| Event::Unusable(Rejection::Malformed(what.to_owned()));
    let position = [0.4, 0.1, 0.3];
    let (orientation_xyzw, frame_id, sent) = ([0.0, 0.0, 0.0, 1.0], "", Sent::default());
    let good = GoalReading { position, orientation_xyzw, frame_id, stamp: 0, waited: Duration::ZERO, sent };
    let events = [Event::Stop, unusable("three bytes"), unusable("no bytes"), Event::Goal(good)];
    rig.now += PERIOD;
    rig.servo.cycle_with(rig.now, events);
    assert_eq!(rig.servo.rejections().by_reason(), [("malformed", 2)]);
    assert_eq!(rig.state(), State::Stopping);
    // A stop after the goal would have dropped it.
    let goal = rig.servo.status().goal.unwrap();
    assert!((goal.base_from_goal().translation() - nalgebra::Vector3::from(position)).norm() < 1e-12);
}
