//! A frame that TF loses for longer than `rearm_timeout` revokes all earlier requests, streams of goals in that frame included.
//! After any revocation, the publisher of a stream must pause. Goals that wait for their frame do not count as a pause.

use crate::reference::{parameters, pose, theta};
use crate::rig::reading;
use crate::sim::{Random, Sim};
use dq_core::servo::{Event, GoalMotion, Reason, Rejection, Revocation, Sent, State};
use std::time::Duration;

/// Returns an arm that was moving to a goal. TF then lost the goal's frame for `seconds`. The publisher sends a goal every `interval`
/// \[s\] all the time.
fn lost_for(seconds: f64, interval: f64) -> Sim {
    let mut sim = Sim::new(&parameters(), theta("theta_initial"));
    sim.run(0.1);
    for _ in 0..(0.6 / interval).ceil() as usize {
        sim.goal_ago(1, &pose("theta_desired"), 0.0, 0.003).unwrap();
        sim.run(interval);
    }
    sim.servo.move_goal(&GoalMotion::Lost, sim.now()).unwrap();
    wait_for(&mut sim, seconds, interval);
    sim
}

/// Sends a goal every `interval` \[s\] for `seconds`. TF does not have the frame of these goals, so that they must wait.
fn wait_for(sim: &mut Sim, seconds: f64, interval: f64) {
    let end = sim.now() + Duration::from_secs_f64(seconds);
    while sim.now() < end {
        sim.servo.take(Event::Waits(Sent { by: 1, ago: Duration::ZERO })).unwrap();
        sim.run(interval.min((end - sim.now()).as_secs_f64()));
    }
}

/// Reports to the servo that TF has the frame of the goal in force again, at its old pose.
fn find(sim: &mut Sim) {
    let place = reading(&pose("theta_desired"), 0);
    sim.servo.move_goal(&GoalMotion::To(place), sim.now()).unwrap();
}

/// Continues the stream for 3 s, with a goal every `interval` \[s\]. The first goal has waited for its frame for `waited` \[s\].
/// Checks that the servo rejects each goal, and that nothing moves.
fn nothing_moves(sim: &mut Sim, waited: f64, interval: f64) {
    let before = sim.q.clone();
    for number in 0..(3.0 / interval) as usize {
        let waited = if number == 0 { waited } else { 0.003 };
        let refused = sim.goal_ago(1, &pose("theta_desired"), 0.0, waited);
        assert!(matches!(refused, Err(Rejection::Superseded(Revocation::FrameWasAway(_)))), "{refused:?}");
        sim.run(interval - waited);
    }
    assert_eq!((sim.state(), &sim.q), (State::Holding, &before));
}

#[test]
fn a_stream_of_goals_in_a_frame_that_was_lost_must_pause() {
    let mut random = Random::new(1);
    for number in 0..20 {
        let seconds = [1.02, 1.2, 1.4, 2.0, 5.0, random.between(1.01, 8.0)][number % 6];
        let interval = [0.02, 0.1, 1.0][number % 3];
        let mut sim = lost_for(seconds, interval);
        assert_eq!(sim.state(), State::Holding, "{seconds}");
        nothing_moves(&mut sim, random.between(0.003, interval), interval);
        find(&mut sim);
        sim.run(1.6);
        sim.goal_ago(1, &pose("theta_desired"), 0.0, 0.003).unwrap();
        sim.run(0.1);
        assert!(sim.state().is_driven(), "it has paused: {}", sim.state());
    }
}

#[test]
fn a_frame_that_says_where_it_is_before_the_stream_is_found_revokes_it_too() {
    for interval in [0.02, 0.1, 1.0] {
        let mut sim = lost_for(5.0, interval);
        find(&mut sim);
        sim.run(0.9 * interval);
        nothing_moves(&mut sim, 0.5 * interval, interval);
    }
}

#[test]
fn a_frame_that_was_lost_for_a_moment_revokes_nothing() {
    let mut sim = lost_for(0.9, 0.1);
    assert_eq!(sim.servo.status().reason, Some(Reason::FrameLost));
    sim.goal_ago(1, &pose("theta_desired"), 0.0, 0.05).unwrap();
    sim.run(0.1);
    assert!(sim.state().is_driven(), "{}", sim.state());
}

#[test]
fn another_publisher_that_asks_after_a_frame_was_lost_moves_the_arm() {
    let mut sim = lost_for(3.0, 0.1);
    let refused = sim.goal_ago(1, &pose("theta_third"), 0.0, 0.0);
    assert!(matches!(refused, Err(Rejection::Superseded(Revocation::FrameWasAway(_)))), "{refused:?}");
    sim.goal_ago(2, &pose("theta_third"), 0.0, 0.003).unwrap();
    sim.run(0.1);
    assert!(sim.state().is_driven(), "{}", sim.state());
}

#[test]
fn a_stream_that_was_stopped_must_pause_even_if_its_frame_is_lost_meanwhile() {
    for (seconds, interval) in [(1.6, 0.02), (5.0, 0.1), (20.0, 1.0)] {
        let mut sim = lost_for(0.1, interval);
        sim.servo.stop();
        wait_for(&mut sim, seconds, interval);
        let before = sim.q.clone();
        for waited in [0.01, 0.003, 0.0] {
            let refused = sim.goal_ago(1, &pose("theta_desired"), 0.0, waited);
            assert!(matches!(refused, Err(Rejection::Superseded(Revocation::Stopped))), "{refused:?}");
            sim.run(interval);
        }
        assert_eq!(sim.q, before);
        sim.run(1.6);
        sim.goal_ago(1, &pose("theta_desired"), 0.0, 0.003).unwrap();
        sim.run(0.1);
        assert!(sim.state().is_driven(), "it has paused: {}", sim.state());
    }
}

#[test]
fn goals_whose_frame_nobody_knows_hinder_no_other_publisher() {
    let mut sim = Sim::new(&parameters(), theta("theta_initial"));
    sim.run(0.1);
    for _ in 0..20 {
        wait_for(&mut sim, 0.05, 0.02);
        sim.goal_ago(2, &pose("theta_desired"), 0.0, 0.0).unwrap();
    }
    sim.servo.take(Event::Pause { paused: true, ago: Duration::ZERO }).unwrap();
    wait_for(&mut sim, 0.5, 0.02);
    sim.servo.take(Event::Pause { paused: false, ago: Duration::ZERO }).unwrap();
    sim.run(0.1);
    assert!(sim.state().is_driven(), "{} {:?}", sim.state(), sim.servo.status().reason);
}
