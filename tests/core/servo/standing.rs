//! What makes the arm stand, and what lets it go on: ~/pause, ~/stop, stalls (rule 9), the end (rule 10); all states.

use crate::bench::Bench;
use dq_servo::servo::State;
use std::time::Duration;

#[test]
fn pause_holds_and_resumes_and_stop_drops_the_goal() {
    let mut bench = Bench::new();
    bench.goal("theta_desired");
    bench.run(0.5);
    bench.servo.pause(true);
    bench.run(0.3);
    assert_eq!((bench.state(), bench.speed()), (State::Paused, 0.0));
    bench.servo.pause(false);
    bench.run(0.1);
    assert_eq!(bench.state(), State::Tracking);
    bench.servo.stop();
    bench.cycle();
    assert_eq!(bench.state(), State::Stopping);
    bench.run(0.3);
    assert_eq!((bench.state(), bench.speed()), (State::Holding, 0.0));
    assert!(bench.servo.at_rest() && bench.servo.status().goal.is_none());
}

#[test]
fn rule_10_after_a_stop_come_zeros_until_there_is_another_goal() {
    let mut bench = Bench::new();
    bench.goal("theta_desired");
    bench.run(0.5);
    bench.servo.stop();
    bench.run_until(State::Holding, 1.0);
    for _ in 0..500 {
        bench.cycle();
        assert!(bench.servo.at_rest() && bench.servo.command() == [0.0; 6]);
    }
    bench.goal("theta_desired");
    bench.run(0.1);
    assert_eq!(bench.state(), State::Tracking);
}

#[test]
fn a_goal_during_a_stop_waits_for_standstill() {
    let mut bench = Bench::new();
    bench.goal("theta_desired");
    bench.run(0.5);
    bench.servo.stop();
    bench.goal("theta_initial");
    bench.cycle();
    assert_eq!(bench.state(), State::Stopping);
    bench.run(0.2);
    assert_eq!(bench.state(), State::Tracking);
}

#[test]
fn a_stop_keeps_a_pause() {
    let mut bench = Bench::new();
    bench.goal("theta_desired");
    bench.run(0.5);
    bench.servo.pause(true);
    bench.servo.stop();
    bench.goal("theta_initial");
    bench.run(0.3);
    assert_eq!((bench.state(), bench.speed()), (State::Paused, 0.0));
    bench.run(1.0);
    assert_eq!((bench.state(), bench.speed()), (State::Paused, 0.0));
    bench.servo.pause(false);
    bench.run(0.1);
    assert_eq!(bench.state(), State::Tracking);
}

/// Joint 3, which has to go from 2.36 to 1.05 rad, may not.
fn hold_joint_3(settings: &mut dq_servo::servo::Settings<dq_servo::control::Controller>) {
    settings.limits.position.lower[2] = 1.6;
}

/// A bench whose arm has stalled, because joint 3 is held by its position limit.
fn stalled() -> Bench<dq_servo::servo::OneArm> {
    let mut bench = Bench::with(|settings| {
        settings.progress_timeout = Some(Duration::from_secs(1));
        hold_joint_3(settings);
    });
    bench.goal("theta_desired");
    bench.run(1.0);
    bench.run_until(State::Stalled, 30.0);
    bench.run(3.0);
    assert_eq!(
        (bench.state(), bench.speed()),
        (State::Stalled, 0.0),
        "not before there is reason to try again"
    );
    bench
}

#[test]
fn rule_9_without_progress_the_arm_stalls_until_another_goal() {
    let mut bench = stalled();
    bench.goal("theta_initial");
    bench.run_until(State::Settled, 30.0);
}

#[test]
fn rule_9_a_stall_ends_by_other_parameters_but_not_by_the_same() {
    let mut bench = stalled();
    bench.change(|_| {});
    bench.cycle();
    assert_eq!(bench.state(), State::Stalled);
    bench.change(|settings| settings.limits.position.lower[2] = f64::NEG_INFINITY);
    bench.run_until(State::Settled, 30.0);
}

#[test]
fn rule_9_a_stall_ends_by_a_pause_that_ends() {
    let mut bench = stalled();
    bench.servo.pause(true);
    bench.cycle();
    assert_eq!(bench.state(), State::Paused);
    bench.servo.pause(false);
    bench.cycle();
    assert_eq!(bench.state(), State::JointLimit);
}

#[test]
fn rule_9_the_same_goal_ends_a_stall_after_a_silence_but_not_as_a_stream() {
    let mut bench = stalled();
    // stalled() has been silent for long.
    bench.goal("theta_desired");
    bench.cycle();
    assert_eq!(bench.state(), State::JointLimit);
    for _ in 0..20 {
        bench.goal("theta_desired");
        bench.run(0.1);
    }
    assert_eq!(bench.state(), State::Stalled, "a stream of the same goal is no reason");
    bench.run(1.1);
    bench.goal("theta_desired");
    bench.cycle();
    assert_eq!(bench.state(), State::JointLimit);
}

#[test]
fn rule_9_the_time_of_a_pause_and_of_stale_joint_states_is_no_lack_of_progress() {
    let mut bench = Bench::with(|settings| {
        settings.progress_timeout = Some(Duration::from_secs(1));
        settings.rearm_timeout = Duration::from_secs(10);
    });
    bench.goal("theta_desired");
    bench.run(0.3);
    bench.servo.pause(true);
    bench.run(3.0);
    bench.servo.pause(false);
    bench.run(0.3);
    assert_eq!(bench.state(), State::Tracking);
    bench.connect(false);
    bench.run(3.0);
    bench.connect(true);
    bench.run(0.3);
    assert_eq!(bench.state(), State::Tracking);
}

#[test]
fn rule_9_without_the_timeout_nothing_stalls() {
    let mut bench = Bench::with(|settings| {
        settings.progress_timeout = None;
        hold_joint_3(settings);
    });
    bench.goal("theta_desired");
    bench.run(40.0);
    assert_eq!(bench.state(), State::JointLimit);
}

#[test]
fn each_of_the_eleven_states_is_met_and_has_its_name() {
    let mut bench = Bench::with(|settings| {
        settings.progress_timeout = Some(Duration::from_secs(1));
        settings.goal_timeout = Some(Duration::from_secs(20));
        // Joint 3 goes from 2.36 to 1.05 rad.
        settings.limits.position.lower[2] = 1.6;
    });
    let mut met = vec![];
    let mut meet = |bench: &mut Bench<_>, state, seconds| {
        bench.run_until(state, seconds);
        met.push(state.name());
        assert_eq!(state.name().parse(), Ok(state));
    };
    bench.connect(false);
    meet(&mut bench, State::WaitingForState, 0.1);
    bench.connect(true);
    meet(&mut bench, State::Holding, 0.1);
    bench.goal("theta_desired");
    meet(&mut bench, State::Tracking, 0.1);
    bench.connect(false);
    meet(&mut bench, State::StaleState, 0.2);
    bench.connect(true);
    meet(&mut bench, State::JointLimit, 5.0);
    meet(&mut bench, State::Stalled, 30.0);
    bench.goal("theta_initial");
    meet(&mut bench, State::Settled, 15.0);
    meet(&mut bench, State::StaleGoal, 21.0);
    bench.goal("theta_third");
    bench.servo.set_listeners(0, false);
    meet(&mut bench, State::NotFollowing, 0.1);
    bench.servo.pause(true);
    meet(&mut bench, State::Paused, 0.1);
    bench.servo.stop();
    meet(&mut bench, State::Stopping, 0.1);
    met.sort_unstable();
    met.dedup();
    assert_eq!(met.len(), 11);
}
