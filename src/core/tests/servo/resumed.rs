//! A call of `~/pause` (false) requests again the goal that was in force when the call was sent. The servo rejects the call if a
//! revoked stream of goals continues.

use crate::reference::{parameters, pose, theta};
use crate::rig::Rig;
use crate::sim::{Random, Sim};
use dq_core::servo::{Contended, Event, Rejection, Revocation, STREAM, State};
use std::time::Duration;

/// Calls `~/pause` (false) with a request that was sent `ago` seconds earlier.
fn resume(sim: &mut Sim, ago: f64) -> Result<bool, Rejection> {
    let now = sim.now();
    sim.servo.begin(now);
    sim.servo.take(Event::Pause { paused: false, ago: Duration::from_secs_f64(ago) })
}

/// Returns how far the joints move within half a second \[rad\].
fn travel(sim: &mut Sim) -> f64 {
    let before = sim.q.clone();
    sim.run(0.5);
    sim.q.iter().zip(&before).map(|(now, before)| (now - before).abs()).fold(0.0, f64::max)
}

/// Returns an arm in motion to a goal of publisher 1. If `streams`, the goal is sent every 0.1 s until now.
fn on_its_way(streams: bool) -> Sim {
    let mut sim = Sim::new(&parameters(), theta("theta_initial"));
    sim.run(0.1);
    for number in 0..10 {
        if streams || number == 0 {
            sim.goal(1, &pose("theta_desired")).unwrap();
        }
        sim.run(0.1);
    }
    sim
}

#[test]
fn a_request_to_go_on_that_was_sent_before_the_robot_jumped_is_refused_and_a_later_one_is_not() {
    let mut random = Random::new(7);
    for number in 0..40 {
        let mut sim = on_its_way(false);
        sim.q[number % 6] += 1.0;
        let since = random.between(0.02, 0.3);
        sim.run(since);
        assert_eq!(sim.state(), State::Holding);
        let early = random.between(since + 0.01, 0.99);
        let refused = resume(&mut sim, early);
        assert!(matches!(refused, Err(Rejection::Overtaken(Revocation::IsElsewhere(..)))), "{refused:?}");
        assert_eq!(travel(&mut sim), 0.0, "sent {early} s ago, {since} s after the jump");
        resume(&mut sim, 0.3).unwrap();
        assert!(travel(&mut sim) > 0.1, "{}", sim.state());
    }
}

#[test]
fn a_request_to_go_on_that_was_sent_before_a_stop_leaves_a_pause_as_it_is() {
    let mut sim = on_its_way(false);
    sim.servo.pause(true);
    sim.servo.stop();
    sim.run(1.0);
    sim.servo.stop();
    let refused = resume(&mut sim, 0.1);
    assert_eq!(refused, Err(Rejection::Overtaken(Revocation::Stopped)));
    sim.goal(2, &pose("theta_third")).unwrap();
    assert_eq!((travel(&mut sim), sim.state()), (0.0, State::Paused));
    resume(&mut sim, 0.1).unwrap();
    assert!(travel(&mut sim) > 0.1);
}

#[test]
fn a_request_to_go_on_that_was_sent_before_a_second_driver_was_heard_is_refused() {
    let mut sim = on_its_way(false);
    for _ in 0..10 {
        sim.other_states(7);
        sim.cycle();
    }
    let refused = resume(&mut sim, 0.1);
    let states = Contended::JointStates(0);
    assert_eq!(refused, Err(Rejection::Overtaken(Revocation::Rivals(states))));
    sim.run(1.0);
    assert_eq!((sim.speed(), sim.robot_speed()), (0.0, 0.0));
}

#[test]
fn an_arm_does_not_go_on_while_goals_that_are_revoked_are_sent_on() {
    // At 500, 50 and 1 Hz.
    for every in [0.002, 0.02, 1.0] {
        let mut sim = on_its_way(true);
        sim.q[3] += 1.0;
        sim.run(0.05);
        let mut next = sim.time;
        for _ in 0..8 {
            let end = sim.time + 0.5;
            while sim.time < end {
                if sim.time >= next {
                    next += every;
                    let refused = sim.goal(1, &pose("theta_third"));
                    assert!(matches!(refused, Err(Rejection::Superseded(_))), "{refused:?}");
                }
                sim.cycle();
            }
            let before = sim.q.clone();
            let refused = resume(&mut sim, 0.0).unwrap_err();
            assert!(matches!(refused, Rejection::StreamsOn(Revocation::IsElsewhere(..))), "{refused:?}");
            assert!(refused.to_string().contains("let their publisher send nothing for 1.5 s"), "{refused}");
            assert_eq!((sim.state(), &sim.q), (State::Holding, &before));
        }
        sim.run(STREAM.as_secs_f64() + 0.01);
        resume(&mut sim, 0.0).unwrap();
        assert!(travel(&mut sim) > 0.1, "it has paused: {}", sim.state());
    }
}

#[test]
fn a_request_to_go_on_leaves_a_goal_that_nothing_has_revoked_as_new_as_it_is() {
    let mut rig = Rig::new();
    rig.run(2.0);
    rig.connect(false);
    rig.run(0.9);
    rig.goal("theta_desired");
    let request = Event::Pause { paused: false, ago: Duration::from_millis(500) };
    rig.servo.take(request).unwrap();
    assert_eq!(rig.servo.consent().request().unwrap().pushed, rig.now);
}
