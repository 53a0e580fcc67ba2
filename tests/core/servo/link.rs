//! What connects the servo to its robot: whose joint states count, a robot that was away, one that does not follow.

use crate::bench::{Bench, PERIOD};
use dq_servo::servo::{ArmFigures, Contact, JointReading, OneArm, Rearm, Reason, State, TwoArms};
use std::time::Duration;

/// A bench under way to its goal.
fn in_motion() -> Bench<OneArm> {
    let mut bench = Bench::new();
    bench.goal("theta_desired");
    bench.run(0.5);
    assert_eq!(bench.state(), State::Tracking);
    bench
}

fn rearm(bench: &Bench<OneArm>) -> Option<Rearm> {
    match bench.servo.status().reason {
        Some(Reason::Rearm(why)) => Some(why),
        _ => None,
    }
}

/// Stands for a second, and goes on when the goal comes again.
fn needs_the_goal_again(bench: &mut Bench<OneArm>) {
    bench.run(1.0);
    assert_eq!((bench.state(), bench.speed()), (State::Holding, 0.0));
    bench.goal("theta_desired");
    bench.run_until(State::Settled, 30.0);
    assert_eq!(bench.servo.status().reason, None);
}

#[test]
fn rule_15_a_goal_does_not_outlive_a_long_absence_of_the_robot() {
    let mut bench = in_motion();
    bench.connect(false);
    bench.run(1.2);
    assert_eq!(bench.state(), State::StaleState);
    bench.connect(true);
    bench.cycle();
    assert!(matches!(rearm(&bench), Some(Rearm::WasAway(away)) if (1.1..1.3).contains(&away)));
    let words = rearm(&bench).unwrap().explain(|joint| joint.to_string());
    assert!(words.starts_with("the robot was away for 1.2 s") && words.contains("~/pause"), "{words}");
    needs_the_goal_again(&mut bench);
}

#[test]
fn rule_15_a_goal_outlives_a_short_absence() {
    let mut bench = in_motion();
    bench.connect(false);
    bench.run(0.9);
    bench.connect(true);
    bench.run_until(State::Settled, 30.0);
}

#[test]
fn rule_15_the_end_of_a_pause_renews_a_goal_too() {
    let mut bench = in_motion();
    bench.connect(false);
    bench.run(1.2);
    bench.connect(true);
    bench.run(0.2);
    assert_eq!(bench.state(), State::Holding);
    bench.servo.pause(false);
    bench.run_until(State::Settled, 30.0);
}

#[test]
fn rule_15_a_goal_that_came_during_the_absence_counts_while_it_is_young() {
    for (age, driven) in [(0.9, true), (1.1, false)] {
        let mut bench = in_motion();
        bench.connect(false);
        bench.run(2.0);
        bench.goal("theta_third");
        bench.run(age);
        bench.connect(true);
        bench.run(0.2);
        assert_eq!(bench.state() == State::Tracking, driven, "{age} s");
    }
}

#[test]
fn rule_15_a_robot_that_came_back_elsewhere_needs_the_goal_again() {
    let mut bench = in_motion();
    bench.connect(false);
    bench.run(0.3);
    bench.plants[0].reset();
    let mut elsewhere = bench.plants[0].positions().to_vec();
    elsewhere[3] -= 2.5;
    bench.plants[0] = dq_servo::plant::Plant::new(elsewhere, Duration::from_millis(100));
    bench.connect(true);
    bench.cycle();
    assert!(matches!(rearm(&bench), Some(Rearm::IsElsewhere(4, _))), "{:?}", bench.servo.status().reason);
    needs_the_goal_again(&mut bench);
}

#[test]
fn rule_15_a_goal_of_long_ago_does_not_move_a_robot_that_starts() {
    let mut bench = Bench::new();
    bench.connect(false);
    bench.goal("theta_desired");
    bench.run(20.0);
    bench.connect(true);
    bench.cycle();
    assert!(matches!(rearm(&bench), Some(Rearm::CameLater(age)) if (19.9..20.1).contains(&age)));
    needs_the_goal_again(&mut bench);
}

#[test]
fn rule_15_servo_plant_and_goal_started_within_a_moment_just_work() {
    let mut bench = Bench::new();
    bench.connect(false);
    bench.run(0.3);
    bench.goal("theta_desired");
    bench.run(0.7);
    bench.connect(true);
    bench.run_until(State::Settled, 30.0);
}

#[test]
fn rule_15_one_arm_of_two_that_was_away_is_enough() {
    let mut bench = Bench::two_arms();
    bench.run(0.1);
    let goal = bench.servo.pose().unwrap()
        * dq_servo::dq::UnitDualQuaternion::screw_exp(&[0.0, 0.0, 0.3, 0.0, 0.1, 0.0].into());
    bench.goal_pose(&goal);
    bench.run(0.3);
    bench.connected[1] = false;
    bench.run(1.5);
    bench.connected[1] = true;
    bench.run(0.5);
    assert_eq!((bench.state(), bench.speed()), (State::Holding, 0.0));
    bench.goal_pose(&goal);
    bench.run_until(State::Settled, 30.0);
}

#[test]
fn rule_16_two_publishers_of_our_joints_make_the_arm_stand_until_one_has_gone_and_the_goal_comes_again() {
    let mut bench = in_motion();
    let elsewhere = [0.3; 6];
    let mut seen = 0;
    for _ in 0..1000 {
        let (names, now) = (&bench.names, bench.now);
        let reading =
            JointReading { names, positions: &elsewhere, velocities: &[], source: 7, stamp_age: None };
        let believed = bench.servo.take_joint_state(0, &reading, now).unwrap();
        assert!(!believed, "the first one is believed");
        bench.cycle();
        if matches!(bench.servo.status().reason, Some(Reason::Rivals(rivals)) if (rivals.first, rivals.second) == (0, 7))
        {
            seen += 1;
        }
    }
    assert!(seen >= 995, "{seen}");
    assert_eq!((bench.state(), bench.speed()), (State::Holding, 0.0));
    bench.goal("theta_third");
    bench.run(1.5);
    assert_eq!(rearm(&bench), Some(Rearm::TwoSources));
    needs_the_goal_again(&mut bench);
}

#[test]
fn rule_16_a_publisher_that_takes_over_from_one_that_has_gone_is_followed() {
    let mut bench = in_motion();
    bench.connect(false);
    bench.run(0.3);
    bench.connect(true);
    bench.source = 1;
    bench.run_until(State::Settled, 30.0);
}

#[test]
fn rule_16_a_gripper_on_the_same_topic_changes_nothing() {
    let mut bench = in_motion();
    let names: Vec<_> = (0..6).map(|finger| format!("finger{finger}")).collect();
    for _ in 0..500 {
        let gripper =
            JointReading { names: &names, positions: &[0.0; 6], velocities: &[], source: 3, stamp_age: None };
        bench.cycle();
        assert_eq!(bench.state(), State::Tracking);
        assert!(bench.servo.take_joint_state(0, &gripper, bench.now).is_err());
    }
    assert_eq!(bench.servo.status().reason, None);
}

/// How far the largest step of the commands goes from here on [rad/s], until the goal is reached.
fn largest_step_to_the_goal(bench: &mut Bench<OneArm>) -> f64 {
    let (mut largest, end) = (0.0_f64, bench.now + Duration::from_secs(30));
    while bench.state() != State::Settled {
        assert!(bench.now < end, "{}", bench.state());
        let before = bench.plants[0].velocities().to_vec();
        bench.cycle();
        let steps = before.iter().zip(bench.plants[0].velocities()).map(|(a, b)| (b - a).abs());
        largest = steps.fold(largest, f64::max);
    }
    largest
}

#[test]
fn rule_17_an_arm_that_does_not_follow_gets_zeros_and_starts_from_rest_when_it_does() {
    let mut bench = Bench::new();
    bench.following = false;
    bench.run(0.1);
    bench.goal("theta_desired");
    let (mut cycles_with_zero, mut fastest) = (0, 0.0_f64);
    for _ in 0..5000 {
        bench.cycle();
        fastest = fastest.max(bench.speed());
        cycles_with_zero += usize::from(bench.speed() == 0.0);
    }
    assert_eq!(bench.state(), State::NotFollowing);
    assert_eq!(bench.servo.status().reason, Some(Reason::DoesNotMove(0)));
    assert!(fastest <= 0.05 + 1e-9 && cycles_with_zero > 3000, "{fastest} rad/s, {cycles_with_zero}");
    bench.following = true;
    // In the plant, whose command begins when its controller does.
    let largest = largest_step_to_the_goal(&mut bench);
    assert!(largest <= 50.0 * PERIOD.as_secs_f64() * (1.0 + 1e-9), "{largest}");
}

#[test]
fn rule_17_an_arm_that_ceases_to_follow_in_motion_is_noticed_and_goes_on_from_rest() {
    for law in [dq_servo::control::Law::Logc, dq_servo::control::Law::Diffc] {
        let mut bench = Bench::new();
        bench.set_law(law);
        bench.goal("theta_desired");
        bench.run(0.15);
        bench.following = false;
        bench.run_until(State::NotFollowing, 0.4);
        bench.run(0.2);
        assert_eq!(bench.speed(), 0.0, "{law}");
        bench.run(3.0);
        bench.following = true;
        let largest = largest_step_to_the_goal(&mut bench);
        assert!(largest <= 50.0 * PERIOD.as_secs_f64() * (1.0 + 1e-9), "{law}: {largest}");
    }
}

#[test]
fn rule_17_one_joint_that_does_not_follow_is_enough() {
    let mut bench = Bench::new();
    bench.goal("theta_desired");
    bench.run(0.15);
    bench.stuck_joint = Some(2);
    bench.run_until(State::NotFollowing, 0.5);
}

#[test]
fn rule_17_without_subscribers_the_arm_is_not_driven_and_that_is_said_at_once() {
    let mut bench = Bench::new();
    bench.servo.set_listeners(0, false);
    bench.cycle();
    assert_eq!(bench.state(), State::Holding, "there is nothing to command");
    bench.goal("theta_desired");
    bench.cycle();
    assert_eq!((bench.state(), bench.speed()), (State::NotFollowing, 0.0));
    assert_eq!(bench.servo.status().reason, Some(Reason::NobodyListens(0)));
    bench.run(1.0);
    assert_eq!(bench.speed(), 0.0);
    bench.servo.set_listeners(0, true);
    bench.run_until(State::Settled, 30.0);
}

#[test]
fn rule_17_an_arm_of_two_that_does_not_follow_stops_both() {
    let mut bench: Bench<TwoArms> = Bench::two_arms();
    bench.run(0.1);
    let goal = bench.servo.pose().unwrap()
        * dq_servo::dq::UnitDualQuaternion::screw_exp(&[0.0, 0.0, 0.3, 0.0, 0.1, 0.0].into());
    bench.goal_pose(&goal);
    bench.run(0.1);
    bench.following = false;
    bench.run_until(State::NotFollowing, 1.0);
    bench.following = true;
    bench.run_until(State::Settled, 30.0);
}

#[test]
fn rule_17_an_arm_that_coasts_when_the_servo_starts_is_braked_within_the_limits() {
    let speeds = [1.0, -0.5, 0.0, 2.0, 0.0, 0.1];
    // With velocities in the joint states, and without.
    for velocities in [true, false] {
        let mut bench = Bench::new();
        bench.with_velocities = velocities;
        bench.check_commands = false;
        bench.plants[0].take_command(&speeds, bench.now).unwrap();
        bench.plants[0].step(bench.now);
        let (mut before, mut largest, mut stopped) = (speeds.to_vec(), 0.0_f64, None);
        for cycle in 0..200 {
            // Its last command holds until ours come.
            if bench.state() == State::WaitingForState {
                bench.plants[0].take_command(&speeds, bench.now).unwrap();
            }
            bench.cycle();
            let now = bench.plants[0].velocities();
            let steps = now.iter().zip(&before).map(|(now, before)| (now - before).abs());
            largest = steps.fold(largest, f64::max);
            before = now.to_vec();
            if bench.speed() == 0.0 && bench.state() != State::WaitingForState {
                stopped.get_or_insert(cycle);
            }
        }
        // 50 rad/s² of 2 ms; velocities by differences are a little off.
        assert!(largest <= 0.11, "{velocities}: {largest}");
        assert!((15..60).contains(&stopped.unwrap()), "{velocities}: {stopped:?}");
        assert_eq!(bench.state(), State::Holding);
    }
}

#[test]
fn rule_17_old_states_that_come_after_an_absence_start_nothing() {
    let mut bench = in_motion();
    let (names, moving) = (bench.names.clone(), bench.plants[0].velocities().to_vec());
    let old = bench.plants[0].positions().to_vec();
    bench.connect(false);
    bench.run(3.0);
    let now = bench.now;
    let reading =
        JointReading { names: &names, positions: &old, velocities: &moving, source: 0, stamp_age: None };
    bench.servo.take_joint_state(0, &reading, now).unwrap();
    bench.servo.step(now).unwrap();
    bench.connect(true);
    for _ in 0..100 {
        bench.cycle();
        assert_eq!(bench.speed(), 0.0);
    }
    assert_eq!(bench.state(), State::Holding);
}

#[test]
fn figures_of_a_recording_take_the_place_of_those_found_out() {
    let mut bench = in_motion();
    let figures = ArmFigures { contact: Contact::Nobody, ..*bench.servo.arm_figures().next().unwrap() };
    bench.servo.repeat_with(0, figures);
    bench.cycle();
    assert_eq!(bench.state(), State::NotFollowing);
    bench.cycle();
    assert_eq!(bench.state(), State::Tracking);
}
