//! Tests of goals of joint positions.

use crate::arms::{anywhere, servo};
use crate::reference::{distance, pose, puma, theta};
use crate::rig::{PERIOD, Rig, reading};
use dq_core::servo::{
    Contended, Event, GoalMotion, Interface, JointGoalError, JointGoalReading, NoWayRound, Outcome, Reason,
    Reconfigure, Rejection, Requester, Revocation, Rivals, Sent, Stall, State,
};
use dq_kinematics::control::{Aim, Law};
use dq_plant::Realism;
use std::time::Duration;

/// Returns the arm on its way from theta_initial to the joint positions theta_desired.
fn underway() -> Rig {
    let mut rig = Rig::new();
    rig.run(0.1);
    rig.joint_goal(&theta("theta_desired"));
    rig.run(0.3);
    assert!(rig.state() == State::Tracking && rig.speed() > 0.1, "{} {}", rig.state(), rig.speed());
    rig
}

/// Sends a joint goal of publisher `by` that names one joint.
fn one_joint(rig: &mut Rig, by: u32, joint: usize, position: f64) -> Result<(), Rejection> {
    let mut positions = vec![None; rig.positions().len()];
    positions[joint] = Some(position);
    rig.take_joint_goal(&positions, Sent { by, ago: Duration::ZERO })
}

fn outcomes(rig: &mut Rig) -> Vec<(u64, Outcome)> {
    rig.servo.take_motions().map(|motion| (motion.number, motion.outcome)).collect()
}

#[test]
fn a_joint_goal_moves_all_joints_on_a_straight_line_and_is_a_motion_like_any_other() {
    for interface in [Interface::Velocity, Interface::Position, Interface::Trajectory] {
        for law in [Law::Logc, Law::Diffc] {
            let mut rig = Rig::with(|settings| {
                (settings.interface, settings.controller.law) = (interface, law);
            });
            rig.run(0.1);
            let (start, end) = (rig.positions(), theta("theta_desired"));
            rig.joint_goal(&end);
            let mut places = Vec::new();
            while rig.state() != State::Settled {
                rig.cycle();
                places.push(rig.positions());
                assert!(places.len() < 3000, "{} {:?}", rig.state(), rig.servo.status());
            }
            let widest =
                (0..6).max_by(|a, b| (end[*a] - start[*a]).abs().total_cmp(&(end[*b] - start[*b]).abs()));
            let joint = widest.unwrap();
            for place in &places {
                let part = (place[joint] - start[joint]) / (end[joint] - start[joint]);
                let line = start.iter().zip(&end).map(|(start, end)| start + part * (end - start));
                assert!(distance(place, &line.collect::<Vec<_>>()) < 1e-6, "{interface} {place:?}");
            }
            rig.run(3.0);
            assert!(distance(&rig.positions(), &end) < 1e-6, "{interface}: {:?}", rig.positions());
            assert_eq!((rig.state(), rig.speed()), (State::Settled, 0.0));
            let motions: Vec<_> = rig.servo.take_motions().collect();
            assert_eq!(
                motions.iter().map(|it| it.outcome).collect::<Vec<_>>(),
                [Outcome::Underway, Outcome::Arrived]
            );
            let last = &motions[1];
            assert!(last.by_joints && !last.reconfigured && matches!(last.asker, Requester::Goal(_)));
            assert!(last.goal.base_from_goal().distances(&pose("theta_desired"))[0] < 1e-9);
            let figures = last.figures;
            let (arrival, cycles) = (figures.arrival_time.unwrap(), places.len() as f64);
            assert!((arrival - cycles * PERIOD.as_secs_f64()).abs() < 0.01, "{arrival} s, {cycles} cycles");
            assert!(figures.position_error < 1e-3 && figures.path_length > 0.3, "{figures:?}");
        }
    }
}

#[test]
fn joints_that_the_goal_lacks_keep_their_goal_or_stay() {
    let mut rig = Rig::new();
    rig.run(0.1);
    let start = rig.positions();
    one_joint(&mut rig, 1, 1, start[1] + 0.4).unwrap();
    rig.run(0.1);
    one_joint(&mut rig, 2, 3, start[3] - 0.2).unwrap();
    rig.run_until(State::Settled, 5.0);
    rig.run(2.0);
    let mut there = start.clone();
    (there[1], there[3]) = (start[1] + 0.4, start[3] - 0.2);
    assert!(distance(&rig.positions(), &there) < 1e-6);
    // After a pose goal, and after a stop, they stay where they are.
    for ends in [|rig: &mut Rig| rig.goal("theta_desired"), Rig::stop] {
        ends(&mut rig);
        rig.run(20.0);
        let mut there = rig.positions();
        there[0] += 0.3;
        one_joint(&mut rig, 3, 0, there[0]).unwrap();
        rig.run_until(State::Settled, 5.0);
        rig.run(2.0);
        assert!(distance(&rig.positions(), &there) < 1e-6);
    }
}

#[test]
fn a_joint_goal_that_is_impossible_is_rejected_with_its_reason_and_the_last_goal_stays() {
    let mut rig = Rig::with(|settings| {
        (settings.limits.position.lower[2], settings.limits.position.upper[2]) = (-1.0, 2.5);
    });
    let sent = Sent { by: 9, ago: Duration::ZERO };
    let mut positions = [None; 6];
    positions[2] = Some(1.0);
    let unknown = rig.take_joint_goal(&positions, Sent { by: 8, ..sent }).unwrap_err();
    assert_eq!(unknown, JointGoalError::NoState(1).into(), "no joint state has come");
    rig.run(0.1);
    rig.goal("theta_desired");
    rig.cycle();
    let goal = rig.servo.status().goal;
    let mut reject = |positions: &[Option<f64>]| {
        let why = rig.take_joint_goal(positions, sent).unwrap_err();
        rig.cycle();
        assert_eq!((rig.servo.status().goal, rig.state()), (goal, State::Tracking));
        (why.label(), why.text())
    };
    for nothing in [&[None; 6][..], &[]] {
        assert_eq!(reject(nothing), ("empty", "the joint goal has no positions".to_owned()));
    }
    for count in [5, 7] {
        let length = ("wrong_length", format!("{count} numbers, expected 6: one per joint, arm after arm"));
        assert_eq!(reject(&vec![Some(0.1); count]), length);
    }
    for number in [f64::NAN, f64::INFINITY] {
        let mut positions = positions;
        positions[5] = Some(number);
        assert_eq!(reject(&positions).0, "non_finite");
    }
    positions[5] = Some(-2e5);
    assert_eq!(reject(&positions).0, "out_of_range");
    positions[5] = None;
    for outside in [2.51, -1.01] {
        positions[2] = Some(outside);
        let text = format!("joint 3 (joint3) cannot go to {outside} rad: its limits are -1 and 2.5 rad");
        assert_eq!(reject(&positions), ("outside_limits", text));
    }
}

/// Other tests check the rules for goals with pose goals, and with random sequences of pose goals and joint goals. This test checks
/// each rule once with a joint goal.
#[test]
fn every_rule_of_goals_holds_for_joint_goals() {
    let mut rig = underway();
    rig.stop();
    rig.run(2.0);
    assert_eq!((rig.state(), rig.speed()), (State::Holding, 0.0));
    assert_eq!(outcomes(&mut rig).last(), Some(&(1, Outcome::Revoked(Revocation::Stopped))));

    let mut rig = underway();
    rig.twist([0.0, 0.0, 0.05], [0.0; 3], "base_link").unwrap();
    rig.cycle();
    assert_eq!(rig.state(), State::Jogging);
    assert_eq!(one_joint(&mut rig, 5, 0, 0.0), Err(Rejection::Jogging));
    rig.run(3.0);
    assert_eq!((rig.state(), rig.speed()), (State::Holding, 0.0));

    let mut rig = underway();
    let late = Sent { by: 5, ago: Duration::from_secs(3) };
    let taken = rig.take_joint_goal(&[Some(0.1); 6], late);
    assert_eq!(taken, Err(Rejection::Late(late.ago)));

    let mut rig = underway();
    rig.connect(false);
    rig.run(3.0);
    rig.connect(true);
    rig.run(1.0);
    assert_eq!((rig.state(), rig.speed()), (State::Holding, 0.0));
    // A request to go on leads to the same joint positions.
    rig.pause(false);
    rig.run_until(State::Settled, 5.0);
    rig.run(2.0);
    assert!(distance(&rig.positions(), &theta("theta_desired")) < 1e-6);

    let mut rig = underway();
    rig.pause(true);
    rig.run(2.0);
    assert_eq!((rig.state(), rig.speed()), (State::Paused, 0.0));
    rig.pause(false);
    rig.run_until(State::Settled, 5.0);

    // A stream does not outlive a stop, and a second stream is a rival, of whatever kind both are.
    let mut rig = underway();
    rig.stop();
    for _ in 0..300 {
        let _: Result<(), Rejection> = one_joint(&mut rig, 5, 0, 1.0);
        (0..5).for_each(|_| rig.cycle());
    }
    assert_ne!(rig.state(), State::Holding, "the stream began after the stop");
    rig.stop();
    for _ in 0..300 {
        let rejected = one_joint(&mut rig, 5, 0, 1.5).unwrap_err();
        assert!(matches!(rejected, Rejection::Superseded(Revocation::Stopped)), "{rejected}");
        (0..5).for_each(|_| rig.cycle());
    }
    assert_eq!(rig.speed(), 0.0);
    for number in 0..300 {
        if number % 2 == 0 {
            let _: Result<(), Rejection> = rig.take_goal(&reading(&pose("theta_desired"), 0));
        } else {
            let _: Result<(), Rejection> = one_joint(&mut rig, 7, 0, 1.5);
        }
        (0..5).for_each(|_| rig.cycle());
    }
    let rivals = Rivals { of: Contended::Goals, first: 0, second: 7 };
    assert_eq!((rig.servo.status().reason, rig.speed()), (Some(Reason::Rivals(rivals)), 0.0));
}

#[test]
fn a_joint_goal_replaces_a_pose_goal_and_the_other_way_round() {
    let mut rig = underway();
    rig.goal("theta_third");
    rig.run(0.3);
    rig.joint_goal(&theta("theta_initial"));
    rig.run_until(State::Settled, 10.0);
    rig.run(2.0);
    assert!(distance(&rig.positions(), &theta("theta_initial")) < 1e-6);
    rig.goal("theta_desired");
    rig.cycle();
    rig.run_until(State::Settled, 20.0);
    assert_eq!(
        outcomes(&mut rig),
        [
            (1, Outcome::Underway),
            (1, Outcome::Replaced),
            (2, Outcome::Underway),
            (2, Outcome::Replaced),
            (3, Outcome::Underway),
            (3, Outcome::Arrived),
            (4, Outcome::Underway),
            (4, Outcome::Arrived),
        ]
    );
}

/// The arm has settled at one joint goal when it receives another. Both have the same tool pose, so the tool pose does not show which
/// of the two goals the joints have reached.
#[test]
fn a_joint_goal_with_the_present_tool_pose_has_settled_only_when_the_joints_are_there() {
    for streams in [false, true] {
        let mut rig = Rig::new();
        rig.run(0.1);
        let start = rig.positions();
        let goal = |place: &[f64]| place.iter().copied().map(Some).collect::<Vec<_>>();
        let sent = Sent { by: 1, ago: Duration::ZERO };
        rig.take_joint_goal(&goal(&start), sent).unwrap();
        rig.run_until(State::Settled, 1.0);
        let mut turned = start;
        // The puma's wrist: joint 5 turned over, joints 4 and 6 by half a turn.
        turned[3] += std::f64::consts::PI;
        turned[4] = -turned[4];
        turned[5] += std::f64::consts::PI;
        let pose = puma().forward_kinematics(&turned).unwrap();
        assert!(rig.servo.pose().unwrap().distances(&pose).iter().all(|apart| *apart < 1e-9));
        if !streams {
            rig.run(3.0);
        }
        rig.take_joint_goal(&goal(&turned), sent).unwrap();
        rig.cycle();
        assert_eq!(rig.state(), State::Tracking);
        rig.run_until(State::Settled, 10.0);
        // A joint without limits turns the shorter way, and so may end a whole turn away.
        let apart = |(is, goal): (&f64, &f64)| (is - goal).sin().abs() < 0.01 && (is - goal).cos() > 0.0;
        assert!(rig.positions().iter().zip(&turned).all(apart), "{:?}", rig.positions());
        rig.run(2.0);
        let arrivals: Vec<_> =
            outcomes(&mut rig).into_iter().filter(|(_, outcome)| *outcome == Outcome::Arrived).collect();
        let last = if streams { 1 } else { 2 };
        assert_eq!(arrivals, [(1, Outcome::Arrived), (last, Outcome::Arrived)]);
    }
}

/// A publisher jogs a joint with a stream of joint goals. Each goal is 0.005 rad farther than the previous goal.
#[test]
fn a_stream_of_joint_goals_is_one_motion() {
    let mut rig = Rig::new();
    rig.run(0.1);
    let start = rig.positions();
    for step in 1..=100 {
        one_joint(&mut rig, 1, 2, start[2] - 0.005 * f64::from(step)).unwrap();
        (0..10).for_each(|_| rig.cycle());
    }
    rig.run(3.0);
    let mut there = start;
    there[2] -= 0.5;
    assert!(distance(&rig.positions(), &there) < 1e-6);
    assert_eq!(outcomes(&mut rig), [(1, Outcome::Underway), (1, Outcome::Arrived)]);
}

#[test]
fn a_joint_goal_behind_a_new_limit_stalls_and_looks_for_no_other_configuration() {
    let mut rig = Rig::with(|settings| {
        settings.reconfigure = Reconfigure::Always;
        settings.progress_timeout = Some(Duration::from_secs(1));
    });
    rig.run(0.1);
    rig.joint_goal(&theta("theta_desired"));
    rig.run(0.1);
    rig.change(|settings| settings.limits.position.lower[2] = 1.6);
    rig.run_until(State::Stalled, 10.0);
    rig.run(3.0);
    let status = rig.servo.status();
    assert_eq!((status.state, status.stall), (State::Stalled, Some(Stall::AtLimit { joint: 3 })));
    rig.servo.begin(rig.now);
    let round = rig.servo.take(Event::Reconfigure { ago: Duration::ZERO });
    assert!(matches!(round, Err(Rejection::NoWayRound(NoWayRound::NotLookedFor(_)))), "{round:?}");
    rig.change(|settings| settings.limits.position.lower[2] = -9.0);
    rig.run_until(State::Settled, 10.0);
}

#[test]
fn under_another_tool_a_joint_goal_is_the_same_joint_positions() {
    let mut rig = underway();
    rig.change(|settings| settings.tool_offset = pose("theta_third"));
    rig.run(1.0);
    assert_eq!(rig.revoked(), Some(Revocation::AnotherTool));
    rig.pause(false);
    rig.run_until(State::Settled, 10.0);
    rig.run(2.0);
    assert!(distance(&rig.positions(), &theta("theta_desired")) < 1e-6);
    let status = rig.servo.status();
    assert!(status.figures.position_error < 1e-6, "{:?}", status.figures);
}

#[test]
fn no_frame_moves_a_joint_goal() {
    let mut rig = underway();
    let motion = reading(&pose("theta_third"), 0);
    rig.move_goal(&GoalMotion::To(motion)).unwrap();
    rig.move_goal(&GoalMotion::Lost).unwrap();
    rig.run_until(State::Settled, 10.0);
    rig.run(1.0);
    assert!(distance(&rig.positions(), &theta("theta_desired")) < 1e-6);
}

#[test]
fn the_joints_of_two_arms_arrive_together_also_if_only_a_part_of_the_pose_is_controlled() {
    for aim in Aim::ALL {
        let mut rig = Rig::two_arms_with(|settings| settings.controller.aim = aim);
        rig.run(0.1);
        let goal = [theta("theta_third"), theta("theta_desired")].concat();
        rig.joint_goal(&goal);
        rig.run_until(State::Settled, 10.0);
        rig.run(2.0);
        assert!(distance(&rig.positions(), &goal) < 1e-6, "{aim:?}");
    }
}

/// In every cycle the rig checks speeds, accelerations and position limits. If commands have no delay, it also checks tool speeds.
#[test]
fn arms_of_the_box_keep_their_limits_on_the_way_to_joint_goals_and_arrive() {
    for name in ["ur5e", "xarm6", "panda", "iiwa14"] {
        for number in 0..12 {
            let parameters = servo(name);
            let limits = parameters.settings.limits.position.clone();
            let joints = parameters.arms.joint_count();
            let [start, there] = [anywhere(&limits, number), anywhere(&limits, 500 + number)];
            let mut rig = Rig::of(parameters, start[..joints].to_vec());
            rig.command_delay = Duration::from_millis(10 * number as u64);
            rig.check_tools = number == 0;
            rig.run(0.1);
            rig.joint_goal(&there[..joints]);
            rig.run_until(State::Settled, 30.0);
            rig.run(3.0);
            assert!(distance(&rig.positions(), &there[..joints]) < 1e-3, "{name} {number}");
            assert_eq!(rig.state(), State::Settled);
        }
    }
}

#[test]
fn an_arm_with_delay_lag_and_coarse_encoders_arrives_at_a_joint_goal_and_stands_there() {
    for (delay, lag, resolution) in [(0, 0, 1e-3), (20, 0, 5e-4), (10, 50, 0.0), (20, 30, 5e-4)] {
        let mut rig = Rig::new();
        let [delay, lag] = [delay, lag].map(Duration::from_millis);
        rig.set_lag(lag);
        rig.set_delays(delay, delay);
        let realism = Realism {
            velocity_time_constant: lag,
            encoder_resolution: resolution,
            position_noise: 0.1 * resolution,
            ..Realism::default()
        };
        rig.plants[0].set_realism(realism);
        (rig.check_tools, rig.with_velocities) = (false, false);
        rig.run(0.1);
        rig.joint_goal(&theta("theta_desired"));
        rig.run_until(State::Settled, 10.0);
        let mut fastest: f64 = 0.0;
        for _ in 0..2500 {
            rig.cycle();
            fastest = fastest.max(rig.speed());
            assert_eq!(rig.state(), State::Settled, "{delay:?} {lag:?} {resolution}");
        }
        assert!(fastest < 0.1, "{delay:?} {lag:?} {resolution}: {fastest} rad/s");
        assert!(distance(&rig.positions(), &theta("theta_desired")) < 2.5 * resolution + 1e-6);
    }
}

#[test]
fn under_a_payload_a_joint_goal_stalls_as_sagging_and_arrives_with_the_integral() {
    for integral in [0.0, 2.0] {
        let mut rig = Rig::with(|settings| {
            settings.integral = integral;
            settings.progress_timeout = Some(Duration::from_secs(2));
        });
        rig.pull[1] = 0.3;
        rig.run(0.1);
        rig.joint_goal(&theta("theta_desired"));
        rig.run(20.0);
        let stall = rig.servo.status().stall;
        match integral {
            0.0 => assert!(matches!(stall, Some(Stall::Sagging { joint: 2, .. })), "{stall:?}"),
            _ => {
                assert_eq!(rig.state(), State::Settled);
                continue;
            }
        }
        // The same goal starts a stalled arm again only after a silence of `progress_timeout`. Another goal starts it at once.
        for _ in 0..20 {
            rig.joint_goal(&theta("theta_desired"));
            rig.run(0.5);
        }
        assert_eq!(rig.state(), State::Stalled);
        rig.joint_goal(&theta("theta_initial"));
        rig.cycle();
        assert_eq!(rig.state(), State::Tracking);
    }
}

#[test]
fn a_cycle_on_the_way_to_a_joint_goal_allocates_nothing() {
    let mut rig = underway();
    rig.servo.take_motions().for_each(drop);
    rig.allocations = 0;
    rig.run(0.5);
    assert_eq!((rig.state(), rig.allocations), (State::Tracking, 0));
}

/// A program that uses the library may pass any numbers as a joint goal.
#[test]
fn joint_goals_of_any_numbers_are_taken_or_rejected() {
    let numbers = [0.0, 1e5, -1e5, 1e300, f64::NAN, f64::INFINITY, f64::MIN_POSITIVE, 3.0];
    for first in numbers {
        for second in numbers {
            let mut rig = Rig::new();
            (rig.check_positions, rig.check_tools) = (false, false);
            rig.run(0.1);
            let positions = [Some(first), Some(second), None, Some(0.1), None, None];
            let sent = Sent::default();
            let reading = JointGoalReading { positions: &positions, stamp: 0, sent };
            let is_sane = first.abs() <= 1e5 && second.abs() <= 1e5;
            assert_eq!(rig.take_joint_goal(reading.positions, sent).is_ok(), is_sane);
            rig.run(0.1);
            assert!(rig.command.iter().all(|speed| speed.is_finite()));
        }
    }
}
