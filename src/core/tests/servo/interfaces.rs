//! Tests of the commands that the servo sends to controllers of velocities, positions or trajectories.

use crate::reference::distance;
use crate::rig::{Rig, state_of};
use dq_algebra::UnitDualQuaternion;
use dq_core::servo::{Contended, Interface, Reason, Revocation, State};
use std::time::Duration;

/// The interfaces that take positions, with the rates of their cycles \[Hz\].
const OF_POSITIONS: [(Interface, u32); 2] = [(Interface::Position, 500), (Interface::Trajectory, 100)];

fn rig(interface: Interface, rate: u32) -> Rig {
    Rig::at_rate(rate, |settings| settings.interface = interface)
}

/// Returns an arm 0.5 s after it began to move.
fn in_motion(interface: Interface, rate: u32) -> Rig {
    let mut rig = rig(interface, rate);
    rig.goal("theta_desired");
    rig.run(0.5);
    assert!(rig.state() == State::Tracking && rig.speed() > 0.2, "{} at {}", rig.state(), rig.speed());
    rig
}

fn fell_behind(rig: &Rig) -> Option<(usize, f64)> {
    match rig.servo.status().reason {
        Some(Reason::Revoked(Revocation::FellBehind(joint, lead, _))) => Some((joint, lead)),
        _ => None,
    }
}

#[test]
fn nothing_is_sent_before_there_is_a_goal_and_an_arm_whatever_that_takes() {
    for name in Interface::NAMES {
        let mut rig = rig(name.parse().unwrap(), 500);
        rig.connect(false);
        rig.run(0.2);
        assert_eq!((rig.state(), &rig.output), (State::WaitingForState, &None));
        rig.connect(true);
        rig.run(0.5);
        assert_eq!((rig.state(), &rig.output), (State::Holding, &None), "{name}: no goal");
        rig.pause(true);
        rig.stop();
        rig.goal("theta_desired");
        rig.run(0.2);
        assert_eq!((rig.state(), &rig.output), (State::Paused, &None), "{name}: paused");
        rig.pause(false);
        rig.cycle();
        assert!(rig.output.is_some(), "{name}");
        rig.stop();
        rig.run(0.5);
        assert!(rig.state() == State::Holding && rig.output.is_some(), "{name}: it is held from then on");
    }
}

#[test]
fn an_arm_that_takes_positions_arrives_as_one_that_takes_velocities() {
    let mut velocities = in_motion(Interface::Velocity, 500);
    velocities.run_until(State::Settled, 20.0);
    for (interface, rate) in OF_POSITIONS {
        let mut rig = in_motion(interface, rate);
        rig.run_until(State::Settled, 20.0);
        rig.run(1.0);
        assert_eq!(rig.state(), State::Settled, "{interface}");
        let (now, then) = (rig.servo.status().figures, velocities.servo.status().figures);
        assert!((now.path_length - then.path_length).abs() < 0.01, "{interface}: {now:?}");
        assert!(distance(rig.output.as_ref().unwrap(), &rig.positions()) < 1e-3, "{interface}");
    }
}

#[test]
fn a_pause_and_a_stop_leave_the_arm_where_it_came_to_rest() {
    for (interface, rate) in OF_POSITIONS {
        let mut rig = in_motion(interface, rate);
        rig.pause(true);
        rig.run(0.5);
        let held = rig.output.clone();
        rig.run(0.5);
        assert_eq!((rig.state(), rig.speed(), &rig.output), (State::Paused, 0.0, &held));
        rig.pause(false);
        rig.run(0.5);
        rig.stop();
        rig.run(1.0);
        assert_eq!((rig.state(), rig.speed()), (State::Holding, 0.0));
        assert!(distance(rig.output.as_ref().unwrap(), &rig.positions()) < 1e-9);
    }
}

/// A late cycle advances the commanded positions by only one period, so the arm moves more slowly than the speed of the law. The servo
/// must not conclude that the arm does not follow.
#[test]
fn an_arm_that_is_sent_positions_by_late_cycles_is_seen_to_follow() {
    for (interface, rate) in OF_POSITIONS {
        let mut rig = in_motion(interface, rate);
        let end = rig.now + Duration::from_secs(200);
        while rig.state() != State::Settled {
            assert!(rig.now < end, "{interface}: {}", rig.state());
            for late in [0, 6, 9, 3] {
                rig.cycle_late(late);
                assert_ne!(rig.state(), State::NotFollowing, "{interface}");
            }
        }
    }
}

/// Returns the largest distance of a joint from its position in the last output \[rad\].
fn lead(rig: &Rig) -> f64 {
    distance(rig.output.as_ref().unwrap(), &rig.positions())
}

#[test]
fn a_blocked_arm_is_not_run_away_from_and_goes_on_from_where_it_is() {
    for (interface, rate) in OF_POSITIONS {
        let mut rig = in_motion(interface, rate);
        rig.change(|settings| settings.following_error = 0.05);
        rig.following = false;
        let mut furthest = 0.0_f64;
        for _ in 0..8 * rate {
            rig.cycle();
            furthest = rig.output.as_ref().map_or(furthest, |_| furthest.max(lead(&rig)));
        }
        // The arm takes 0.06 rad to brake from 2.5 rad/s at 50 rad/s². The rest is the motion of the servo's gentle trials.
        assert!((0.02..0.2).contains(&furthest), "{interface}: {furthest}");
        assert!(matches!(rig.state(), State::Holding | State::NotFollowing), "{}", rig.state());
        assert!(rig.servo.status().reason.is_some());
        rig.following = true;
        let held = rig.state() == State::Holding;
        rig.pause(false);
        rig.cycle();
        assert!(!held || rig.state() == State::Tracking, "{interface}: a new try, {}", rig.state());
        rig.run_until(State::Settled, 25.0);
    }
}

#[test]
fn an_arm_that_lags_too_far_is_held_with_the_joint_s_name_until_somebody_wants_it_to_go_on() {
    let mut rig = in_motion(Interface::Position, 500);
    rig.change(|settings| settings.following_error = 0.01);
    // One joint is stuck and the others follow, so rule 17 does not apply.
    rig.stuck_joint = Some(0);
    rig.run(1.5);
    let (joint, lead) = fell_behind(&rig).expect("a reason");
    assert!(joint == 1 && lead > 0.01, "{joint} {lead}");
    assert_eq!((rig.state(), rig.speed()), (State::Holding, 0.0));
    assert_eq!(rig.output, None, "the controller holds what it was sent last");
    rig.stuck_joint = None;
    rig.run(0.5);
    assert_eq!(rig.state(), State::Holding, "not by itself");
    rig.goal("theta_desired");
    rig.run_until(State::Settled, 20.0);
}

#[test]
fn an_arm_that_is_moved_by_somebody_else_is_not_pulled_back() {
    let mut rig = in_motion(Interface::Position, 500);
    rig.stop();
    rig.run(0.5);
    assert!(rig.output.is_some());
    rig.following = false;
    // Somebody moves the arm slowly by hand, so that it does not jump.
    for _ in 0..500 {
        let moved: Vec<_> = rig.positions().iter().map(|angle| angle + 0.001).collect();
        rig.cycle();
        let now = rig.now;
        rig.plants[0].take_positions(&moved, now, Duration::ZERO).unwrap();
        rig.plants[0].step(now);
    }
    assert_eq!(rig.output, None);
    rig.following = true;
    let before = rig.positions();
    rig.run(1.0);
    assert_eq!(rig.positions(), before, "nobody asked for more");
    rig.goal("theta_desired");
    rig.run_until(State::Settled, 20.0);
}

#[test]
fn a_robot_that_comes_back_elsewhere_is_not_sent_to_where_it_was() {
    let mut rig = in_motion(Interface::Position, 500);
    rig.connect(false);
    rig.run(3.0);
    assert_eq!(rig.state(), State::StaleState);
    let elsewhere: Vec<_> = rig.positions().iter().map(|angle| angle + 0.7).collect();
    rig.plants[0] = dq_plant::Plant::new(elsewhere.clone(), Duration::from_millis(100));
    rig.following = false;
    rig.connect(true);
    rig.run(0.1);
    assert_eq!((rig.state(), &rig.output), (State::Holding, &None));
    rig.following = true;
    rig.run(0.5);
    assert_eq!(rig.positions(), elsewhere);
    rig.goal("theta_desired");
    rig.cycle();
    assert!(distance(rig.output.as_ref().unwrap(), &elsewhere) < 1e-3);
    rig.run_until(State::Settled, 20.0);
}

#[test]
fn a_second_publisher_of_joint_states_stops_an_arm_that_takes_positions_without_a_jolt() {
    for (interface, rate) in OF_POSITIONS {
        let mut rig = in_motion(interface, rate);
        let period = 1.0 / f64::from(rate);
        let mut sent = vec![rig.output.clone().unwrap()];
        for _ in 0..rate {
            let names = &rig.names;
            let other = state_of(names, &[0.3; 6], 7);
            assert_eq!(rig.servo.take_joint_state(0, &other, rig.now), Ok(false));
            rig.cycle();
            sent.push(rig.output.clone().expect("it is sent where it goes, until it stands and after"));
        }
        assert_eq!((rig.state(), rig.speed()), (State::Holding, 0.0));
        assert_eq!(rig.servo.status().reason.map(|why| matches!(why, Reason::Rivals(_))), Some(true));
        let limits = &rig.servo.settings().limits;
        for (cycle, three) in sent.windows(3).enumerate() {
            let joints = three[0].iter().zip(&three[1]).zip(&three[2]);
            for (joint, ((first, second), third)) in joints.enumerate() {
                let change = third - 2.0 * second + first;
                let most = limits.deceleration(joint).max(limits.joint_acceleration[joint]) * period * period;
                assert!(change.abs() <= most * (1.0 + 1e-6), "{interface}: {change} at {cycle}");
            }
        }
        // The other publisher has ended. The arm continues from its position.
        rig.run(1.5);
        assert_eq!(
            rig.servo.status().reason,
            Some(Reason::Revoked(Revocation::Rivals(Contended::JointStates(0))))
        );
        rig.pause(false);
        rig.run_until(State::Settled, 20.0);
    }
}

#[test]
fn an_arm_that_jumps_while_two_give_its_joint_states_is_not_sent_back() {
    let mut rig = in_motion(Interface::Position, 500);
    for cycle in 0..500 {
        let names = &rig.names;
        let other = state_of(names, &[0.3; 6], 7);
        rig.servo.take_joint_state(0, &other, rig.now).unwrap();
        if cycle == 5 {
            rig.plants[0].reset();
        }
        rig.cycle();
        assert_eq!(rig.output.is_some(), cycle < 5, "{cycle}");
    }
}

#[test]
fn a_delay_that_is_known_is_no_following_error() {
    let mut rig = rig(Interface::Position, 500);
    rig.change(|settings| {
        settings.following_error = 0.03;
        settings.latency = Some(Duration::from_millis(40));
    });
    (rig.command_delay, rig.state_delay) = (Duration::from_millis(20), Duration::from_millis(20));
    rig.check_tools = false;
    rig.goal("theta_desired");
    rig.run_until(State::Settled, 30.0);
}

#[test]
fn an_arm_that_takes_positions_keeps_its_position_limits() {
    let mut rig = Rig::at_rate(500, |settings| {
        settings.interface = Interface::Position;
        settings.limits.position.lower[2] = 1.6;
    });
    let goal: UnitDualQuaternion = crate::reference::pose("theta_desired");
    rig.goal_pose(&goal);
    // The rig checks the positions against the limits.
    rig.run_until(State::Stalled, 40.0);
    assert!(rig.output.as_ref().unwrap()[2] >= 1.6);
}

#[test]
fn a_plant_that_is_reset_stays_at_its_start_until_the_servo_has_seen_that() {
    for (interface, rate) in OF_POSITIONS {
        for moving in [false, true] {
            let mut rig = in_motion(interface, rate);
            rig.state_delay = Duration::from_millis(10);
            if !moving {
                rig.run_until(State::Settled, 30.0);
            }
            rig.plants[0].reset();
            let start = rig.positions();
            rig.run(1.0);
            assert_eq!(rig.positions(), start, "{interface}");
            let reason = rig.servo.status().reason;
            // If the arm was in motion, the position after the reset may look like one on its way. Then the reason is
            // `FellBehind`.
            let is_seen = matches!(
                reason,
                Some(Reason::Revoked(Revocation::IsElsewhere(..) | Revocation::FellBehind(..)))
            );
            assert!(is_seen, "{interface}: {reason:?}");
            rig.goal("theta_third");
            rig.run_until(State::Settled, 30.0);
        }
    }
}
