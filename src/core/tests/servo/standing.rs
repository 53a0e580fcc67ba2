//! The reasons why the arm stands, and how it resumes: ~/pause, ~/stop, stalls (rule 9) and the end of the program (rule 10). Every
//! state occurs in a test.

use crate::rig::Rig;
use dq_core::servo::{Event, State};
use std::time::Duration;

#[test]
fn pause_holds_and_resumes_and_rule_10_after_a_stop_come_zeros_until_there_is_another_goal() {
    let mut rig = Rig::in_motion(0.5);
    rig.pause(true);
    rig.run(0.3);
    assert_eq!((rig.state(), rig.speed()), (State::Paused, 0.0));
    rig.pause(false);
    rig.run(0.1);
    assert_eq!(rig.state(), State::Tracking);
    rig.stop();
    rig.cycle();
    assert_eq!(rig.state(), State::Stopping);
    rig.run(0.3);
    assert_eq!((rig.state(), rig.speed()), (State::Holding, 0.0));
    assert!(rig.servo.status().goal.is_none());
    for _ in 0..500 {
        rig.cycle();
        assert!(rig.servo.at_rest() && rig.servo.command() == [0.0; 6]);
    }
    rig.goal("theta_desired");
    rig.run(0.1);
    assert_eq!(rig.state(), State::Tracking);
}

#[test]
fn a_goal_during_a_stop_waits_for_standstill() {
    let mut rig = Rig::in_motion(0.5);
    rig.stop();
    rig.goal("theta_initial");
    rig.cycle();
    assert_eq!(rig.state(), State::Stopping);
    rig.run(0.2);
    assert_eq!(rig.state(), State::Tracking);
}

#[test]
fn a_stop_keeps_a_pause() {
    let mut rig = Rig::in_motion(0.5);
    rig.pause(true);
    rig.stop();
    rig.goal("theta_initial");
    rig.run(0.3);
    assert_eq!((rig.state(), rig.speed()), (State::Paused, 0.0));
    rig.run(1.0);
    assert_eq!((rig.state(), rig.speed()), (State::Paused, 0.0));
    rig.pause(false);
    rig.run(0.1);
    assert_eq!(rig.state(), State::Tracking);
}

/// Limits joint 3 so that the arm cannot arrive. The joint would have to go from 2.36 to 1.05 rad.
fn hold_joint_3(settings: &mut dq_core::servo::Settings) {
    settings.limits.position.lower[2] = 1.6;
}

/// Returns a rig whose arm has stalled because joint 3 is at its position limit.
fn stalled() -> Rig {
    let mut rig = Rig::with(|settings| {
        settings.progress_timeout = Some(Duration::from_secs(1));
        hold_joint_3(settings);
    });
    rig.goal("theta_desired");
    rig.run(1.0);
    rig.run_until(State::Stalled, 30.0);
    rig.run(3.0);
    assert_eq!((rig.state(), rig.speed()), (State::Stalled, 0.0), "not before there is reason to try again");
    rig
}

#[test]
fn rule_9_a_stall_ends_by_other_parameters_but_not_by_the_same() {
    let mut rig = stalled();
    rig.change(|_| {});
    rig.cycle();
    assert_eq!((rig.state(), rig.servo.status().joint_at_limit), (State::Stalled, Some(3)));
    rig.change(|settings| settings.limits.position.lower[2] = f64::NEG_INFINITY);
    rig.run_until(State::Settled, 30.0);
    assert_eq!(rig.servo.status().joint_at_limit, None);
}

#[test]
fn rule_9_a_stall_ends_by_a_pause_that_ends() {
    let mut rig = stalled();
    rig.pause(true);
    rig.cycle();
    assert_eq!(rig.state(), State::Paused);
    rig.pause(false);
    rig.cycle();
    assert_eq!(rig.state(), State::JointLimit);
}

#[test]
fn rule_9_the_same_goal_ends_a_stall_after_a_silence_but_not_as_a_stream() {
    let mut rig = stalled();
    // The publisher has been silent for a long time.
    rig.goal("theta_desired");
    rig.cycle();
    assert_eq!(rig.state(), State::JointLimit);
    for _ in 0..20 {
        rig.goal("theta_desired");
        rig.run(0.1);
    }
    assert_eq!(rig.state(), State::Stalled, "a stream of the same goal is no reason");
    rig.run(1.1);
    rig.goal("theta_desired");
    rig.cycle();
    assert_eq!(rig.state(), State::JointLimit);
}

#[test]
fn rule_9_the_time_of_a_pause_and_of_stale_joint_states_is_no_lack_of_progress() {
    let mut rig = Rig::with(|settings| {
        settings.progress_timeout = Some(Duration::from_secs(1));
        settings.rearm_timeout = Duration::from_secs(10);
    });
    rig.goal("theta_desired");
    rig.run(0.3);
    rig.pause(true);
    rig.run(3.0);
    rig.pause(false);
    rig.run(0.3);
    assert_eq!(rig.state(), State::Tracking);
    rig.connect(false);
    rig.run(3.0);
    rig.connect(true);
    rig.run(0.3);
    assert_eq!(rig.state(), State::Tracking);
}

#[test]
fn rule_9_without_the_timeout_nothing_stalls() {
    let mut rig = Rig::with(|settings| {
        settings.progress_timeout = None;
        hold_joint_3(settings);
    });
    rig.goal("theta_desired");
    rig.run(40.0);
    assert_eq!(rig.state(), State::JointLimit);
}

#[test]
fn each_of_the_eleven_states_is_met_and_has_its_name() {
    let mut rig = Rig::with(|settings| {
        settings.progress_timeout = Some(Duration::from_secs(1));
        settings.goal_timeout = Some(Duration::from_secs(20));
        // Joint 3 goes from 2.36 to 1.05 rad.
        settings.limits.position.lower[2] = 1.6;
    });
    let mut met = vec![];
    let mut meet = |rig: &mut Rig, state, seconds| {
        rig.run_until(state, seconds);
        met.push(state.name());
        assert_eq!(state.name().parse(), Ok(state));
    };
    rig.connect(false);
    meet(&mut rig, State::WaitingForState, 0.1);
    rig.connect(true);
    meet(&mut rig, State::Holding, 0.1);
    rig.goal("theta_desired");
    meet(&mut rig, State::Tracking, 0.1);
    rig.connect(false);
    meet(&mut rig, State::StaleState, 0.2);
    rig.connect(true);
    meet(&mut rig, State::JointLimit, 5.0);
    meet(&mut rig, State::Stalled, 30.0);
    rig.goal("theta_initial");
    meet(&mut rig, State::Settled, 15.0);
    meet(&mut rig, State::StaleGoal, 21.0);
    rig.goal("theta_third");
    rig.servo.set_listeners(0, false);
    meet(&mut rig, State::NotFollowing, 0.1);
    rig.pause(true);
    meet(&mut rig, State::Paused, 0.1);
    rig.stop();
    meet(&mut rig, State::Stopping, 0.1);
    met.sort_unstable();
    met.dedup();
    assert_eq!(met.len(), 11);
}

#[test]
fn a_request_to_go_on_that_comes_late_is_rejected_and_one_to_pause_is_not() {
    let mut rig = Rig::new();
    // The request is taken in a cycle that the rig does not count.
    rig.check_commands = false;
    rig.goal("theta_desired");
    rig.run(0.5);
    let ask = |rig: &mut Rig, paused, seconds| {
        let request = Event::Pause { paused, ago: Duration::from_secs_f64(seconds) };
        rig.servo.cycle_with(rig.now, [request]);
        rig.run(0.3);
        rig.state()
    };
    assert_eq!(ask(&mut rig, true, 60.0), State::Paused);
    assert_eq!(ask(&mut rig, false, 5.9), State::Paused);
    assert_eq!(rig.servo.rejections().by_reason(), [("late", 1)]);
    assert_eq!(ask(&mut rig, false, 0.9), State::Tracking);
}
