//! Tests of the connection to the robot: which publisher's joint states count, joint states that are interrupted, and a robot that does
//! not follow.

use crate::rig::{PERIOD, Rig, state_of};
use dq_core::servo::{Contended, JointReading, Reason, Revocation, State};
use std::time::Duration;

/// Returns a rig in motion to its goal.
fn in_motion() -> Rig {
    let rig = Rig::in_motion(0.5);
    assert_eq!(rig.state(), State::Tracking);
    rig
}

/// Checks that the arm stands after a second. Then calls `want`, which requests a motion, and checks that the arm settles at its goal
/// in a new motion. The figures of the new motion must include nothing of the old motion.
fn stands_until(rig: &mut Rig, want: impl FnOnce(&mut Rig)) {
    rig.run(1.0);
    assert_eq!((rig.state(), rig.speed()), (State::Holding, 0.0));
    let (count, from) = (rig.servo.status().goal_count, rig.servo.pose().unwrap().translation());
    want(rig);
    rig.run_until(State::Settled, 30.0);
    let (status, to) = (rig.servo.status(), rig.servo.pose().unwrap().translation());
    assert_eq!((status.reason, status.goal_count), (None, count + 1));
    assert!((status.figures.straight_line - (to - from).norm()).abs() < 1e-9, "{:?}", status.figures);
}

#[test]
fn rule_15_a_goal_does_not_outlive_a_long_absence_and_is_renewed_by_itself_or_the_end_of_a_pause() {
    let ways: [fn(&mut Rig); 2] = [|rig| rig.goal("theta_desired"), |rig| rig.pause(false)];
    for renew in ways {
        let mut rig = in_motion();
        rig.connect(false);
        rig.run(1.2);
        assert_eq!(rig.state(), State::StaleState);
        rig.connect(true);
        rig.cycle();
        assert!(matches!(rig.revoked(), Some(Revocation::WasAway(away)) if (1.1..1.3).contains(&away)));
        let reason = rig.servo.status().reason.unwrap();
        let words = reason.explain(|joint| joint.to_string(), |_, _| String::new(), |_| String::new());
        assert!(words.starts_with("the robot was away for 1.2 s") && words.contains("~/pause"), "{words}");
        stands_until(&mut rig, renew);
    }
}

#[test]
fn rule_15_a_goal_that_came_during_the_absence_counts_while_it_is_young() {
    for (age, driven) in [(0.9, true), (1.1, false)] {
        let mut rig = in_motion();
        rig.connect(false);
        rig.run(2.0);
        rig.goal("theta_third");
        rig.run(age);
        rig.connect(true);
        rig.run(0.2);
        assert_eq!(rig.state() == State::Tracking, driven, "{age} s");
    }
}

#[test]
fn rule_15_a_robot_that_came_back_elsewhere_needs_the_goal_again() {
    let mut rig = in_motion();
    rig.connect(false);
    rig.run(0.3);
    rig.plants[0].reset();
    let mut elsewhere = rig.plants[0].positions().to_vec();
    elsewhere[3] -= 2.5;
    rig.plants[0] = dq_plant::Plant::new(elsewhere, Duration::from_millis(100));
    rig.connect(true);
    rig.cycle();
    assert!(matches!(rig.revoked(), Some(Revocation::IsElsewhere(4, ..))), "{:?}", rig.servo.status().reason);
    stands_until(&mut rig, |rig| rig.goal("theta_desired"));
}

#[test]
fn rule_15_a_goal_of_long_ago_does_not_move_a_robot_that_starts() {
    let mut rig = Rig::new();
    rig.connect(false);
    rig.goal("theta_desired");
    rig.run(20.0);
    rig.connect(true);
    rig.cycle();
    assert!(matches!(rig.revoked(), Some(Revocation::CameLater(age)) if (19.9..20.1).contains(&age)));
    stands_until(&mut rig, |rig| rig.goal("theta_desired"));
}

#[test]
fn rule_15_servo_plant_and_goal_started_within_a_moment_just_work() {
    let mut rig = Rig::new();
    rig.connect(false);
    rig.run(0.3);
    rig.goal("theta_desired");
    rig.run(0.7);
    rig.connect(true);
    rig.run_until(State::Settled, 30.0);
}

#[test]
fn rule_15_one_arm_of_two_that_was_away_is_enough() {
    let mut rig = Rig::two_arms();
    rig.run(0.1);
    let goal = rig.servo.pose().unwrap()
        * dq_algebra::UnitDualQuaternion::screw_exp(&[0.0, 0.0, 0.3, 0.0, 0.1, 0.0].into());
    rig.goal_pose(&goal);
    rig.run(0.3);
    rig.connected[1] = false;
    rig.run(1.5);
    rig.connected[1] = true;
    rig.run(0.5);
    assert_eq!((rig.state(), rig.speed()), (State::Holding, 0.0));
    rig.goal_pose(&goal);
    rig.run_until(State::Settled, 30.0);
}

#[test]
fn rule_16_two_publishers_of_our_joints_make_the_arm_stand_until_one_has_gone_and_the_goal_comes_again() {
    let mut rig = in_motion();
    let elsewhere = [0.3; 6];
    let mut seen = 0;
    for _ in 0..1000 {
        let (names, now) = (&rig.names, rig.now);
        let reading = state_of(names, &elsewhere, 7);
        let believed = rig.servo.take_joint_state(0, &reading, now).unwrap();
        assert!(!believed, "the first one is believed");
        rig.cycle();
        if matches!(rig.servo.status().reason, Some(Reason::Rivals(rivals)) if (rivals.first, rivals.second) == (0, 7))
        {
            seen += 1;
        }
    }
    assert!(seen >= 995, "{seen}");
    assert_eq!((rig.state(), rig.speed()), (State::Holding, 0.0));
    rig.goal("theta_third");
    rig.run(1.5);
    assert_eq!(rig.revoked(), Some(Revocation::Rivals(Contended::JointStates(0))));
    stands_until(&mut rig, |rig| rig.goal("theta_desired"));
}

#[test]
fn rule_16_a_publisher_that_takes_over_from_one_that_has_gone_is_followed() {
    let mut rig = in_motion();
    rig.connect(false);
    rig.run(0.3);
    rig.connect(true);
    rig.source = 1;
    rig.run_until(State::Settled, 30.0);
}

#[test]
fn rule_16_a_gripper_on_the_same_topic_changes_nothing() {
    let mut rig = in_motion();
    let names: Vec<_> = (0..6).map(|finger| format!("finger{finger}")).collect();
    for _ in 0..500 {
        let gripper = state_of(&names, &[0.0; 6], 3);
        rig.cycle();
        assert_eq!(rig.state(), State::Tracking);
        assert!(rig.servo.take_joint_state(0, &gripper, rig.now).is_err());
    }
    assert_eq!(rig.servo.status().reason, None);
}

/// Returns the largest change of a joint's speed from cycle to cycle until the goal is reached [rad/s].
fn largest_step_to_the_goal(rig: &mut Rig) -> f64 {
    let (mut largest, end) = (0.0_f64, rig.now + Duration::from_secs(30));
    while rig.state() != State::Settled {
        assert!(rig.now < end, "{}", rig.state());
        let before = rig.plants[0].velocities().to_vec();
        rig.cycle();
        let steps = before.iter().zip(rig.plants[0].velocities()).map(|(a, b)| (b - a).abs());
        largest = steps.fold(largest, f64::max);
    }
    largest
}

#[test]
fn rule_17_an_arm_that_does_not_follow_gets_zeros_and_starts_from_rest_when_it_does() {
    let mut rig = Rig::new();
    rig.following = false;
    rig.run(0.1);
    rig.goal("theta_desired");
    let (mut cycles_with_zero, mut fastest) = (0, 0.0_f64);
    rig.run_until(State::NotFollowing, 0.6);
    assert_eq!(rig.servo.status().reason, Some(Reason::DoesNotMove(3)), "the first one, counted from 1");
    for _ in 0..5000 {
        rig.cycle();
        fastest = fastest.max(rig.speed());
        cycles_with_zero += usize::from(rig.speed() == 0.0);
    }
    assert!(matches!(rig.revoked(), Some(Revocation::NotObeyed(..))), "{:?}", rig.revoked());
    assert!(fastest <= 0.05 + 1e-9 && cycles_with_zero > 4500, "{fastest} rad/s, {cycles_with_zero}");
    rig.following = true;
    rig.run(1.0);
    assert_eq!((rig.state(), rig.speed()), (State::Holding, 0.0), "it does not go on by itself");
    rig.goal("theta_desired");
    // The plant takes commands only from the time at which its controller starts.
    let largest = largest_step_to_the_goal(&mut rig);
    assert!(largest <= 50.0 * PERIOD.as_secs_f64() * (1.0 + 1e-9), "{largest}");
}

#[test]
fn rule_17_an_arm_that_ceases_to_follow_in_motion_is_noticed_and_goes_on_from_rest() {
    for law in [dq_kinematics::control::Law::Logc, dq_kinematics::control::Law::Diffc] {
        let mut rig = Rig::new();
        rig.set_law(law);
        rig.goal("theta_desired");
        rig.run(0.15);
        rig.following = false;
        rig.run_until(State::NotFollowing, 0.4);
        rig.run(0.2);
        assert_eq!(rig.speed(), 0.0, "{law}");
        // If the robot follows again within rearm_timeout, the motion continues.
        rig.following = true;
        let largest = largest_step_to_the_goal(&mut rig);
        assert!(largest <= 50.0 * PERIOD.as_secs_f64() * (1.0 + 1e-9), "{law}: {largest}");
    }
}

#[test]
fn rule_17_one_joint_that_does_not_follow_is_enough() {
    let mut rig = Rig::in_motion(0.15);
    rig.stuck_joint = Some(2);
    rig.run_until(State::NotFollowing, 0.5);
}

/// Runs a motion for 20 s with the faulty wires `wires`. Returns the sum of all joints' travel \[rad\], the largest speed of a
/// joint [rad/s], and the revocation.
fn run_with_wires(wires: fn(&mut [f64])) -> (f64, f64, Option<Revocation>) {
    let mut rig = Rig::new();
    (rig.wires, rig.check_tools) = (wires, false);
    rig.set_law(dq_kinematics::control::Law::Diffc);
    rig.goal("theta_desired");
    let (mut travelled, mut fastest) = (0.0, 0.0_f64);
    for _ in 0..10_000 {
        rig.cycle();
        let speeds = rig.plants[0].velocities();
        travelled += speeds.iter().map(|speed| speed.abs()).sum::<f64>() * PERIOD.as_secs_f64();
        fastest = speeds.iter().fold(fastest, |fastest, speed| fastest.max(speed.abs()));
    }
    assert_eq!((rig.state(), rig.speed()), (State::Holding, 0.0));
    (travelled, fastest, rig.revoked())
}

#[test]
fn rule_17_a_joint_that_is_wired_wrongly_is_given_up() {
    let inverted = run_with_wires(|command| command[1] = -command[1]);
    let swapped = run_with_wires(|command| command.swap(0, 1));
    for (travelled, fastest, why) in [inverted, swapped] {
        assert!(matches!(why, Some(Revocation::NotObeyed(..))), "{why:?}: {travelled} rad, {fastest} rad/s");
        // The servo detects the fault before it drives the arm any faster.
        assert!(travelled < 0.5 && fastest < 0.061, "{travelled} rad, {fastest} rad/s");
    }
}

/// At first, the law commands little motion of the arm's last joint, so the fault of this joint shows late. Until a joint has followed a
/// command, the servo drives that joint slowly.
#[test]
fn rule_17_a_last_joint_that_is_inverted_turns_no_farther_than_another() {
    let mut rig = Rig::new();
    rig.wires = |command| command[5] = -command[5];
    rig.check_tools = false;
    rig.goal("theta_desired");
    let start = rig.positions()[5];
    for _ in 0..5000 {
        rig.cycle();
        let (turned, speed) = ((rig.positions()[5] - start).abs(), rig.plants[0].velocities()[5].abs());
        assert!(turned < 0.1 && speed < 0.06, "{turned} rad, {speed} rad/s");
    }
    assert_eq!((rig.state(), rig.speed()), (State::Holding, 0.0));
}

#[test]
fn a_joint_that_goes_three_times_as_far_as_commanded_is_reported_with_the_factor() {
    let mut rig = Rig::new();
    rig.wires = |command| command[2] *= 3.0;
    rig.check_tools = false;
    rig.goal("theta_desired");
    let mut reported = 0;
    for _ in 0..3000 {
        rig.cycle();
        if let Some((joint, factor)) = rig.servo.status().too_far {
            assert!(joint == 3 && (2.0..4.0).contains(&factor), "{joint} {factor}");
            reported += 1;
        }
    }
    assert!(reported > 100, "{reported}");
    let mut sound = Rig::new();
    sound.goal("theta_desired");
    sound.command_delay = Duration::from_millis(40);
    for _ in 0..4000 {
        sound.cycle();
        assert_eq!(sound.servo.status().too_far, None);
    }
}

#[test]
fn rule_17_without_subscribers_the_arm_is_not_driven_and_that_is_said_at_once() {
    let mut rig = Rig::new();
    rig.servo.set_listeners(0, false);
    rig.cycle();
    assert_eq!(rig.state(), State::Holding, "there is nothing to command");
    rig.goal("theta_desired");
    rig.cycle();
    assert_eq!((rig.state(), rig.speed()), (State::NotFollowing, 0.0));
    assert_eq!(rig.servo.status().reason, Some(Reason::NobodyListens(0)));
    rig.run(1.0);
    assert_eq!(rig.speed(), 0.0);
    rig.servo.set_listeners(0, true);
    rig.run_until(State::Settled, 30.0);
}

#[test]
fn rule_17_an_arm_of_two_that_does_not_follow_stops_both() {
    let mut rig: Rig = Rig::two_arms();
    rig.run(0.1);
    let goal = rig.servo.pose().unwrap()
        * dq_algebra::UnitDualQuaternion::screw_exp(&[0.0, 0.0, 0.3, 0.0, 0.1, 0.0].into());
    rig.goal_pose(&goal);
    rig.run(0.1);
    rig.following = false;
    rig.run_until(State::NotFollowing, 1.0);
    rig.following = true;
    rig.run_until(State::Settled, 30.0);
}

#[test]
fn rule_17_an_arm_that_coasts_when_the_servo_starts_is_braked_within_the_limits() {
    let speeds = [1.0, -0.5, 0.0, 2.0, 0.0, 0.1];
    // The joint states have velocities, or have none.
    for velocities in [true, false] {
        let mut rig = Rig::new();
        rig.with_velocities = velocities;
        rig.check_commands = false;
        rig.plants[0].take_command(&speeds, rig.now).unwrap();
        rig.plants[0].step(rig.now);
        let (mut before, mut largest, mut stopped) = (speeds.to_vec(), 0.0_f64, None);
        for cycle in 0..200 {
            // The robot continues its last command until the first command of this servo arrives.
            if rig.state() == State::WaitingForState {
                rig.plants[0].take_command(&speeds, rig.now).unwrap();
            }
            rig.cycle();
            let now = rig.plants[0].velocities();
            let steps = now.iter().zip(&before).map(|(now, before)| (now - before).abs());
            largest = steps.fold(largest, f64::max);
            before = now.to_vec();
            if rig.speed() == 0.0 && rig.state() != State::WaitingForState {
                stopped.get_or_insert(cycle);
            }
        }
        // A change of 50 rad/s² within 2 ms. Velocities from differences of positions are slightly off.
        assert!(largest <= 0.11, "{velocities}: {largest}");
        assert!((15..60).contains(&stopped.unwrap()), "{velocities}: {stopped:?}");
        assert_eq!(rig.state(), State::Holding);
    }
}

#[test]
fn rule_17_old_states_that_come_after_an_absence_start_nothing() {
    let mut rig = in_motion();
    let (names, moving) = (rig.names.clone(), rig.plants[0].velocities().to_vec());
    let old = rig.plants[0].positions().to_vec();
    rig.connect(false);
    rig.run(3.0);
    let now = rig.now;
    let reading =
        JointReading { names: &names, positions: &old, velocities: &moving, source: 0, stamp_age: None };
    rig.servo.take_joint_state(0, &reading, now).unwrap();
    rig.servo.step(now);
    rig.connect(true);
    for _ in 0..100 {
        rig.cycle();
        assert_eq!(rig.speed(), 0.0);
    }
    assert_eq!(rig.state(), State::Holding);
}

/// Joint states at 10 Hz neither move the arm in bursts nor cause repeated warnings. The arm stands, and the status explains how to
/// fix it.
#[test]
fn joint_states_that_are_too_rare_for_the_timeout_name_it() {
    for (interval, rate) in
        [(100, "10 Hz: set state_timeout to 0.20 s"), (200, "5 Hz: set state_timeout to 0.40 s")]
    {
        let mut rig = Rig::new();
        rig.state_interval = Duration::from_millis(interval);
        rig.run(1.5);
        rig.goal("theta_desired");
        for _ in 0..500 {
            rig.cycle();
            let reason = rig.servo.status().reason.unwrap();
            assert_eq!((rig.state(), rig.speed()), (State::StaleState, 0.0));
            let text = reason.explain(|_| String::new(), |_, _| String::new(), |_| String::new());
            assert!(text.contains(rate), "{text}");
        }
        // With that remedy, the arm moves to the goal.
        rig.change(|settings| settings.state_timeout = Duration::from_millis(2 * interval));
        rig.run_until(State::Settled, 60.0);
        assert_eq!(rig.servo.status().reason, None);
    }
    // A single outage does not make joint states rare.
    let mut rig = in_motion();
    rig.connect(false);
    rig.run(0.3);
    assert_eq!((rig.state(), rig.servo.status().reason), (State::StaleState, None));
    rig.connect(true);
    rig.run(0.1);
    assert_ne!(rig.state(), State::StaleState);
}
