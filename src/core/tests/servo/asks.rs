//! Tests of requests and revocations under every disturbance: streams of goals, rival publishers, robots that do not obey, and
//! parameters that change.

use crate::reference::{distance, pose, puma, theta};
use crate::rig::{PERIOD, Rig, reading, twist};
use dq_algebra::UnitDualQuaternion;
use dq_core::servo::{
    Contended, GoalReading, Interface, Reason, Rejection, Revocation, Rivals, STREAM, Sent, State,
    TwistReading,
};
use dq_kinematics::control::{Aim, Law};
use dq_plant::Plant;
use nalgebra::{UnitQuaternion, Vector3};
use std::time::Duration;

/// Returns the tool's pose after each joint has moved by 0.4 rad from its start position.
fn beside() -> UnitDualQuaternion {
    let theta: Vec<_> = theta("theta_initial").iter().map(|angle| angle + 0.4).collect();
    puma().forward_kinematics(&theta).unwrap()
}

/// Sends a goal of the publisher `by` every `every` cycles for `seconds`. Returns the sum of all joints' travel meanwhile \[rad\].
fn stream(rig: &mut Rig, goal: &UnitDualQuaternion, by: u32, every: u32, seconds: f64) -> f64 {
    let cycles = (seconds / PERIOD.as_secs_f64()) as u32;
    let mut travelled = 0.0;
    for cycle in 0..cycles {
        if cycle % every == 0 {
            let sent = Sent { by, ago: Duration::ZERO };
            let _: Result<(), Rejection> = rig.take_goal(&GoalReading { sent, ..reading(goal, 0) });
        }
        let before = rig.positions();
        rig.cycle();
        travelled += before.iter().zip(rig.positions()).map(|(one, other)| (one - other).abs()).sum::<f64>();
    }
    travelled
}

/// Checks that a publisher whose stream continued after a revocation moves the arm only after a pause of the stream.
fn moves_after_a_pause_only(rig: &mut Rig, goal: &UnitDualQuaternion, every: u32) {
    assert!(stream(rig, goal, 1, every, 3.0) < 1e-9, "it streams on: {}", rig.state());
    assert_eq!(rig.state(), State::Holding);
    rig.run(STREAM.as_secs_f64() + 0.01);
    assert!(stream(rig, goal, 1, every, 1.0) > 0.1, "it has paused: {}", rig.state());
}

#[test]
fn a_stream_of_goals_does_not_outlive_a_stop() {
    // At 500, 50 and 1 Hz, as `ros2 topic pub` sends.
    for every in [1, 10, 505] {
        let mut rig = Rig::new();
        stream(&mut rig, &pose("theta_desired"), 1, every, 1.1);
        rig.stop();
        rig.run_until(State::Holding, 1.0);
        moves_after_a_pause_only(&mut rig, &pose("theta_desired"), every);
    }
}

#[test]
fn a_stream_that_sends_invalid_goals_or_twists_for_a_while_has_not_paused() {
    let mut rig = Rig::new();
    let goal = pose("theta_desired");
    stream(&mut rig, &goal, 1, 10, 1.0);
    rig.stop();
    rig.run_until(State::Holding, 1.0);
    let sent = Sent { by: 1, ago: Duration::ZERO };
    for _ in 0..300 {
        let lost = GoalReading { position: [f64::NAN; 3], sent, ..reading(&goal, 0) };
        rig.take_goal(&lost).unwrap_err();
        (0..5).for_each(|_| rig.cycle());
    }
    moves_after_a_pause_only(&mut rig, &goal, 10);
    // A stick that is held behaves in the same way.
    rig.run(STREAM.as_secs_f64() + 0.01);
    let [up, lost] = [0.1, f64::NAN].map(|z| TwistReading { sent, ..twist([0.0, 0.0, z], [0.0; 3], "") });
    rig.take_twist(&up).unwrap();
    rig.stop();
    for _ in 0..300 {
        rig.take_twist(&lost).unwrap_err();
        (0..5).for_each(|_| rig.cycle());
    }
    let before = rig.positions();
    for _ in 0..300 {
        rig.take_twist(&up).unwrap();
        rig.cycle();
    }
    assert_eq!(rig.positions(), before);
}

#[test]
fn a_stream_of_goals_does_not_outlive_a_robot_that_jumped() {
    let mut rig = Rig::new();
    rig.check_positions = false;
    stream(&mut rig, &pose("theta_desired"), 1, 10, 1.0);
    let mut elsewhere = rig.positions();
    elsewhere[3] += 1.5;
    rig.plants[0] = Plant::new(elsewhere, Duration::from_millis(100));
    rig.run(0.3);
    assert!(matches!(rig.revoked(), Some(Revocation::IsElsewhere(4, ..))), "{:?}", rig.servo.status().reason);
    moves_after_a_pause_only(&mut rig, &pose("theta_desired"), 10);
}

#[test]
fn a_stream_of_goals_pushes_an_arm_that_does_not_obey_no_more_often_than_a_single_one() {
    for interface in [Interface::Velocity, Interface::Position] {
        let mut rig = Rig::with(|settings| settings.interface = interface);
        rig.check_tools = false;
        rig.wires = match interface {
            Interface::Velocity => |command| command[1] = -command[1],
            _ => |_| {},
        };
        rig.following = interface == Interface::Velocity;
        let mut tries = 0;
        for _ in 0..20 {
            let before = rig.speed() > 0.0;
            stream(&mut rig, &pose("theta_desired"), 1, 10, 0.05);
            tries += u32::from(rig.speed() > 0.0 && !before);
        }
        stream(&mut rig, &pose("theta_desired"), 1, 10, 20.0);
        assert!(tries <= 3, "{tries}");
        assert!(matches!(rig.revoked(), Some(Revocation::NotObeyed(..))), "{:?}", rig.servo.status().reason);
        assert_eq!(rig.speed(), 0.0);
    }
}

#[test]
fn two_publishers_of_goals_are_rivals_and_one_that_sends_a_single_goal_is_none() {
    let mut rig = Rig::new();
    let goals = [pose("theta_desired"), pose("theta_third")];
    let mut held = 0;
    for cycle in 0..5000 {
        // Each publisher sends at 2 Hz.
        for (by, goal) in [(1, &goals[0]), (2, &goals[1])] {
            if cycle % 250 == 125 * (by - 1) {
                let sent = Sent { by, ago: Duration::ZERO };
                let _: Result<(), Rejection> = rig.take_goal(&GoalReading { sent, ..reading(goal, 0) });
            }
        }
        rig.cycle();
        let rivals = Rivals { of: Contended::Goals, first: 1, second: 2 };
        held += usize::from(rig.servo.status().reason == Some(Reason::Rivals(rivals)));
    }
    assert!(held > 4700 && rig.speed() == 0.0, "{held}");
    rig.run(3.0);
    rig.goal_pose(&goals[0]);
    rig.run(0.3);
    rig.goal_pose(&goals[1]);
    rig.run_until(State::Settled, 20.0);
}

/// Streams goals at `rate` \[Hz\]. Each goal is the pose that the tool had `lag` cycles earlier, plus `offset`. Returns the tool's
/// largest linear and angular speed [m/s, rad/s].
fn fed_back(offset: &UnitDualQuaternion, rate: f64, lag: u32, feed_forward: bool) -> (f64, f64) {
    let mut rig = Rig::with(|settings| settings.feed_forward = feed_forward);
    rig.set_law(Law::Logc);
    let start = vec![0.3, -1.0, 0.0, 0.4, 1.4, 0.1];
    rig.plants[0] = Plant::new(start, Duration::from_millis(100));
    rig.run(0.5);
    let (mut poses, mut fastest) = (Vec::new(), (0.0_f64, 0.0_f64));
    for cycle in 0..1000_u32 {
        poses.push(puma().forward_kinematics(&rig.positions()).unwrap());
        if f64::from(cycle) % (500.0 / rate).round() == 0.0 {
            let measured = poses[(cycle.saturating_sub(lag)) as usize];
            // The offset's translation is along the base's axes, as in "1 cm lower than now"; its rotation is along the tool's
            // axes.
            let goal = UnitDualQuaternion::from_parts(
                measured.rotation() * offset.rotation(),
                measured.translation() + offset.translation(),
            );
            let _: Result<(), Rejection> = rig.take_goal(&reading(&goal, 0));
        }
        rig.cycle();
        let tool = rig.arms().tool_speed(&rig.command);
        fastest = (fastest.0.max(tool.linear), fastest.1.max(tool.angular));
    }
    fastest
}

#[test]
fn the_measured_pose_fed_back_as_the_goal_moves_the_arm_no_faster_than_its_law_does() {
    let along =
        |x: f64| UnitDualQuaternion::from_parts(UnitQuaternion::identity(), Vector3::new(0.0, x, 0.6 * x));
    let turned =
        |angle| UnitDualQuaternion::from_translation_angle_axis(Vector3::zeros(), angle, &Vector3::y_axis());
    for offset in [along(0.005), along(0.05), turned(0.05), turned(0.17)] {
        for rate in [10.0, 30.0, 100.0] {
            for lag in [0, 10, 50, 100] {
                let (fed, law) = (fed_back(&offset, rate, lag, true), fed_back(&offset, rate, lag, false));
                let bound = (1.05 * law.0 + 1e-4, 1.05 * law.1 + 1e-3);
                assert!(fed.0 <= bound.0 && fed.1 <= bound.1, "{rate} Hz, {lag} cycles: {fed:?} {law:?}");
            }
        }
    }
}

/// Returns a rig whose robot ignored all commands for `seconds` in the middle of a motion, as if it was switched off. The joint states
/// continued during this time.
fn stopped_for(interface: Interface, seconds: f64) -> Rig {
    let mut rig = Rig::with(|settings| settings.interface = interface);
    rig.goal("theta_desired");
    rig.run(0.6);
    rig.following = false;
    let place = rig.positions();
    rig.run(seconds);
    if let Some(output) = rig.output.clone().filter(|_| interface.takes_positions()) {
        let farthest = distance(&output, &place);
        assert!(farthest < 1e-3, "it would leap by {farthest} rad");
    }
    rig.following = true;
    rig
}

#[test]
fn an_arm_that_was_switched_off_does_not_go_on_by_itself() {
    for interface in [Interface::Velocity, Interface::Position] {
        for seconds in [1.5, 5.0, 30.0] {
            let mut rig = stopped_for(interface, seconds);
            let place = rig.positions();
            rig.run(3.0);
            assert_eq!((rig.state(), rig.speed()), (State::Holding, 0.0));
            let leap = distance(&rig.positions(), &place);
            assert!(leap < 1e-3, "{interface}: {leap} rad");
            let why = rig.revoked().unwrap();
            assert!(matches!(why.name(), "not_obeyed" | "fell_behind"), "{why:?}");
            rig.pause(false);
            rig.run_until(State::Settled, 20.0);
        }
    }
}

#[test]
fn a_robot_that_was_told_to_be_slow_arrives_later_and_the_status_says_the_factor() {
    type Wires = fn(&mut [f64]);
    const SLOW: [(Wires, f64); 3] = [
        (|command| command.iter_mut().for_each(|speed| *speed *= 0.2), 0.2),
        (|command| command.iter_mut().for_each(|speed| *speed *= 0.1), 0.1),
        (|command| command.iter_mut().for_each(|speed| *speed *= 0.05), 0.05),
    ];
    for (wires, factor) in SLOW {
        let mut rig = Rig::new();
        rig.wires = wires;
        rig.set_law(Law::Logc);
        rig.goal_pose(&beside());
        let mut told = Vec::new();
        for _ in 0..60_000 {
            rig.cycle();
            let status = rig.servo.status();
            assert!(status.state != State::Holding, "{factor}: {:?}", status.reason);
            if status.state == State::Settled {
                break;
            }
            told.push(status.speed_factor);
        }
        let status = rig.servo.status();
        assert_eq!(rig.state(), State::Settled, "{factor} {status:?}");
        let middle = told[told.len() / 2];
        assert!((0.7 * factor..1.4 * factor).contains(&middle), "{factor}: {middle}");
    }
}

#[test]
fn a_robot_that_says_at_which_part_of_its_speed_it_moves_is_believed_for_a_second() {
    let mut rig = Rig::new();
    rig.run(0.1);
    for (told, factor) in [(0.3, 0.3), (7.0, 1.0), (-1.0, 0.0), (f64::NAN, 1.0)] {
        rig.servo.set_speed_scaling(0, told);
        rig.run(0.9);
        assert_eq!(rig.servo.status().speed_factor, factor, "{told}");
    }
    rig.servo.set_speed_scaling(0, 0.3);
    rig.run(1.1);
    assert_eq!(rig.servo.status().speed_factor, 1.0);
}

#[test]
fn one_revocation_hides_no_other() {
    let mut rig = Rig::two_arms();
    rig.run(2.0);
    let goal =
        rig.servo.pose().unwrap() * UnitDualQuaternion::screw_exp(&[0.0, 0.0, 0.3, 0.0, 0.1, 0.0].into());
    rig.connected[1] = false;
    rig.run(1.5);
    // The goal is recent enough for an arm that was away, but older than the jump of the other arm.
    rig.goal_pose(&goal);
    rig.run(0.1);
    let mut elsewhere = rig.plants[0].positions().to_vec();
    elsewhere[1] += 1.0;
    rig.plants[0] = Plant::new(elsewhere, Duration::from_millis(100));
    rig.connected[1] = true;
    rig.run(0.5);
    assert_eq!((rig.state(), rig.speed()), (State::Holding, 0.0));
}

#[test]
fn late_joint_states_now_and_then_do_not_raise_the_latency() {
    let mut rig = Rig::new();
    rig.state_delay = Duration::from_millis(20);
    rig.goal("theta_desired");
    for _ in 0..40 {
        rig.run(0.5);
        rig.state_delay = Duration::from_millis(180);
        rig.cycle();
        rig.run(0.06);
        rig.state_delay = Duration::from_millis(20);
        let latency = rig.servo.status().latency;
        assert!(latency < 0.1, "{latency} s");
    }
}

#[test]
fn a_goal_of_orientation_alone_is_nowhere_beyond_reach() {
    let mut rig = Rig::with(|settings| settings.controller.aim = Aim::Orientation);
    rig.take_point([3.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0], "").unwrap();
    rig.run_until(State::Settled, 20.0);
}

#[test]
fn a_settled_arm_is_sent_zeros() {
    for law in [Law::Logc, Law::Diffc] {
        let mut rig = Rig::new();
        rig.set_law(law);
        rig.goal_pose(&beside());
        rig.run_until(State::Settled, 20.0);
        rig.run(60.0);
        assert_eq!((rig.state(), rig.speed()), (State::Settled, 0.0), "{law} {:?}", rig.servo.status());
    }
}

/// The servo's thread did not run for a while. The robot stood because of its own timeout, so the next command begins at rest.
#[test]
fn after_a_gap_in_the_servo_s_own_cycles_the_ramp_begins_from_the_robot() {
    for missed in [200, 400, 750, 10_000] {
        let mut rig = Rig::new();
        (rig.check_tools, rig.check_positions) = (false, false);
        rig.goal("theta_desired");
        rig.run(0.7);
        assert!(rig.speed() > 0.3);
        rig.cycle_late(missed);
        let first = rig.speed();
        assert!(first <= 50.0 * PERIOD.as_secs_f64() + 1e-9, "{missed}: {first} rad/s");
    }
}

#[test]
fn a_robot_that_moves_ten_times_too_far_is_not_driven() {
    let mut rig = Rig::new();
    rig.wires = |command| command.iter_mut().for_each(|speed| *speed *= 10.0);
    (rig.check_tools, rig.check_positions) = (false, false);
    rig.goal("theta_desired");
    let mut travelled = 0.0;
    for _ in 0..4000 {
        let before = rig.positions();
        rig.cycle();
        travelled += before.iter().zip(rig.positions()).map(|(a, b)| (a - b).abs()).sum::<f64>();
    }
    assert_eq!((rig.state(), rig.speed()), (State::Holding, 0.0), "{travelled} rad");
    assert!(travelled < 6.0, "{travelled} rad");
}

/// Changes a limit every 50 ms during a motion of at most `seconds`. Returns the time after which the motion stalls \[s\], if it
/// does.
fn given_up_under_changes(mut rig: Rig, seconds: f64) -> Option<f64> {
    let begin = rig.now;
    for number in 0..(seconds / 0.05) as u32 {
        rig.change(|settings| settings.limits.linear_speed = 1.0 + 0.01 * f64::from(number % 2));
        rig.run(0.05);
        if rig.state() == State::Stalled {
            rig.run(2.0);
            assert_eq!((rig.state(), rig.speed()), (State::Stalled, 0.0), "changes go on");
            return Some((rig.now - begin).as_secs_f64() - 2.0);
        }
    }
    None
}

#[test]
fn liveness_a_stall_and_an_oscillation_are_seen_however_often_parameters_change() {
    let mut beyond = Rig::with(|settings| {
        settings.progress_timeout = Some(Duration::from_secs(2));
        settings.limits.position.lower[2] = 1.6;
    });
    beyond.goal("theta_desired");
    let given_up = given_up_under_changes(beyond, 30.0);
    assert!(given_up.is_some_and(|time| time < 15.0), "{given_up:?}");

    let mut swinging = Rig::with(|settings| {
        settings.controller.set_gains(Law::Diffc, [1000.0; 2]);
        settings.latency = Some(Duration::ZERO);
    });
    swinging.set_law(Law::Diffc);
    (swinging.command_delay, swinging.state_delay) = (Duration::from_millis(40), Duration::from_millis(40));
    (swinging.check_tools, swinging.stamped) = (false, false);
    swinging.goal("theta_third");
    let given_up = given_up_under_changes(swinging, 30.0);
    assert!(given_up.is_some_and(|time| time < 12.0), "{given_up:?}");
}
