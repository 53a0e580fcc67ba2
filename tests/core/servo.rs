//! The cycle in fake time: each safety rule (DESIGN section 8) a test.

use crate::bench::{Bench, PERIOD};
use crate::reference::{json, numbers, parameters};
use dq_servo::control::Law;
use dq_servo::dq::UnitDualQuaternion;
use dq_servo::plant::Plant;
use dq_servo::servo::{CycleTiming, Goal, Rejection, Servo, State};
use proptest::prelude::*;
use std::time::Duration;

const ZEROS: [f64; 6] = [0.0; 6];

#[test]
fn rule_1_nothing_moves_before_a_joint_state_and_a_goal() {
    let mut bench = Bench::new();
    bench.connect(false);
    bench.goal("theta_desired");
    bench.run(0.1);
    assert_eq!((bench.state(), bench.speed()), (State::WaitingForState, 0.0));
    let mut bench = Bench::new();
    bench.run(0.1);
    assert_eq!((bench.state(), bench.speed()), (State::Holding, 0.0));
}

#[test]
fn every_law_arrives_and_says_so() {
    for law in [Law::Logc, Law::DoubleGeodesic, Law::Diffc] {
        let mut bench = Bench::new();
        bench.set_law(law);
        bench.run(0.1);
        bench.goal("theta_desired");
        bench.run_until(State::Settled, 30.0);
        let figures = bench.servo.status().figures;
        assert!(figures.position_error <= 1e-3 && figures.rotation_error <= 1e-2, "{law}");
        assert!((figures.straight_line - 0.559).abs() < 2e-3 && figures.path_length >= figures.straight_line);
        assert!(figures.settling_time().unwrap() <= figures.arrival_time.unwrap(), "{law}");
    }
}

#[test]
fn logc_settles_as_the_reference_run_did() {
    let mut bench = Bench::new();
    bench.run(0.1);
    bench.goal("theta_desired");
    bench.run(12.0);
    let figures = bench.servo.status().figures;
    // DESIGN section 4: 3.9 s (rotation), 4.2 s (position), joint speeds up to 2.5 rad/s.
    assert!((figures.settling_time_rotation.unwrap() - 3.9).abs() < 0.1, "{figures:?}");
    assert!((figures.settling_time_position.unwrap() - 4.2).abs() < 0.1, "{figures:?}");
    assert!((figures.peak_joint_speed - 2.5).abs() < 0.1, "{figures:?}");
}

#[test]
fn rule_2_stale_joint_states_stop_the_arm_within_one_timeout_and_fresh_ones_resume() {
    let mut bench = Bench::new();
    bench.goal("theta_desired");
    bench.run(0.5);
    assert!(bench.speed() > 0.5);
    bench.connect(false);
    bench.run(0.104);
    assert_eq!(bench.state(), State::StaleState);
    bench.run(0.1);
    assert_eq!(bench.speed(), 0.0);
    bench.connect(true);
    bench.run_until(State::Settled, 30.0);
}

#[test]
fn rule_3_goals_are_latched_unless_a_timeout_makes_them_a_stream() {
    let mut bench = Bench::with(|settings| settings.goal_timeout = Some(Duration::from_millis(200)));
    bench.goal("theta_desired");
    bench.run(0.19);
    assert_eq!(bench.state(), State::Tracking);
    bench.goal("theta_desired");
    bench.run(0.19);
    assert_eq!(bench.state(), State::Tracking);
    bench.run(0.2);
    assert_eq!((bench.state(), bench.speed()), (State::StaleGoal, 0.0));
    assert_eq!(bench.servo.status().goal_count, 1, "the same goal again is no new motion");
}

#[test]
fn rule_4_bad_messages_are_rejected_counted_and_leave_the_last_good_ones() {
    let mut bench = Bench::new();
    bench.goal("theta_desired");
    bench.run(0.1);
    let before = bench.servo.status().goal;
    let unit = [0.0, 0.0, 0.0, 1.0];
    let now = bench.now;
    for (position, orientation, frame, label) in [
        ([f64::NAN, 0.0, 0.0], unit, "", "non_finite"),
        ([0.0; 3], [0.0, f64::INFINITY, 0.0, 1.0], "", "non_finite"),
        ([0.0; 3], [0.0; 4], "", "not_unit"),
        ([0.0; 3], [0.0, 0.0, 0.0, 1.002], "", "not_unit"),
        ([0.0; 3], [1e200; 4], "", "not_unit"),
        ([0.0; 3], unit, "map", "unknown_frame"),
    ] {
        let rejection = bench.servo.take_goal(position, orientation, frame, now).unwrap_err();
        assert_eq!(rejection.label(), label);
    }
    let names = bench.names.clone();
    let mut nan = ZEROS.to_vec();
    nan[3] = f64::NAN;
    for (names, positions, label) in [
        (&names[..5], vec![0.0; 5], "missing_joint"),
        (&names[..], vec![0.0; 5], "wrong_length"),
        (&names[..], nan, "non_finite"),
        (&[][..], vec![], "missing_joint"),
    ] {
        assert_eq!(bench.servo.take_joint_state(0, names, &positions, now).unwrap_err().label(), label);
    }
    bench.run(0.01);
    assert_eq!(bench.servo.status().goal, before);
    assert_eq!(bench.servo.rejections().total(), 10);
    assert_eq!(bench.servo.rejections().by_reason()[0], ("non_finite", 3));
    // Rounding is no mistake.
    bench.servo.take_goal([0.1; 3], [0.0, 0.0, 0.0, 1.0009], "/base_link", now).unwrap();
}

#[test]
fn joint_states_are_matched_by_name() {
    let mut bench = Bench::new();
    let mut names = bench.names.clone();
    names.reverse();
    names.push("gripper".to_owned());
    let mut positions = bench.plants[0].positions().to_vec();
    positions.reverse();
    positions.push(f64::NAN);
    bench.servo.take_joint_state(0, &names, &positions, bench.now).unwrap();
    bench.servo.step(bench.now).unwrap();
    let expected = crate::reference::puma().forward_kinematics(bench.plants[0].positions()).unwrap();
    assert_eq!(bench.servo.pose(), Some(expected));
}

#[test]
fn rule_5_speed_limits_scale_the_whole_vector() {
    let run = |limit: f64| {
        let mut bench = Bench::with(|settings| {
            settings.limits.joint_velocity = vec![limit; 6];
            settings.limits.joint_acceleration = vec![1e4; 6];
        });
        bench.goal("theta_desired");
        bench.cycle();
        bench.command
    };
    let (free, limited) = (run(5.0), run(0.2));
    let ratio = limited.iter().zip(&free).map(|(a, b)| a / b).collect::<Vec<_>>();
    assert!(limited.iter().all(|speed| speed.abs() <= 0.2 + 1e-12));
    assert!(ratio.iter().all(|r| (r - ratio[0]).abs() < 0.05 * ratio[0].abs()), "{ratio:?}");
}

#[test]
fn rule_5_cartesian_speeds_are_capped() {
    let mut bench = Bench::with(|settings| settings.limits.linear_speed = 0.05);
    bench.goal("theta_desired");
    let mut last = None;
    for _ in 0..500 {
        bench.cycle();
        let point = bench.servo.pose().unwrap().translation();
        if let Some(last) = last.replace(point) {
            assert!((point - last).norm() <= 0.05 * PERIOD.as_secs_f64() * 1.05);
        }
    }
}

#[test]
fn rule_6_switches_pauses_and_parameters_never_step_the_command() {
    let mut bench = Bench::new();
    bench.goal("theta_desired");
    for i in 0..60 {
        bench.run(0.05);
        bench.set_law([Law::Diffc, Law::Logc, Law::DoubleGeodesic][i % 3]);
        if i % 7 == 0 {
            bench.servo.pause(i % 2 == 0);
        }
        if i == 30 {
            bench.change(|settings| settings.limits.joint_velocity = vec![0.3; 6]);
        }
    }
    // `cycle` has checked every command on the way.
}

#[test]
fn rule_6_a_high_gain_neither_overshoots_nor_shakes_under_the_acceleration_limit() {
    let mut bench = Bench::with(|settings| settings.limits.joint_acceleration = vec![5.0; 6]);
    bench.set_law(Law::Diffc);
    bench.goal("theta_desired");
    bench.run(3.0);
    // In the slow end of the motion the joints do not swing: each keeps its direction.
    let before = bench.command.clone();
    let mut swings = 0;
    let mut last = before;
    for _ in 0..500 {
        bench.cycle();
        swings += last.iter().zip(&bench.command).filter(|(a, b)| **a * **b < 0.0).count();
        last.clone_from(&bench.command);
    }
    assert!(swings <= 6, "{swings} changes of direction in a second");
    bench.run_until(State::Settled, 40.0);
}

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
fn rule_8_a_singular_start_is_left() {
    let mut bench = Bench::new();
    bench.plants[0] = Plant::new(ZEROS.to_vec(), Duration::from_millis(100));
    bench.run(0.01);
    assert!(bench.servo.status().smallest_singular_value < 1e-6);
    bench.goal("theta_desired");
    bench.run_until(State::Settled, 30.0);
}

#[test]
fn rule_11_lateness_and_missed_cycles_are_counted() {
    let mut timing = CycleTiming::default();
    (0..99).for_each(|_| timing.add(Duration::from_micros(50), 0));
    timing.add(Duration::from_millis(3), 2);
    assert_eq!(timing.p99(), Duration::from_micros(51));
    assert_eq!((timing.max(), timing.overruns()), (Duration::from_millis(3), 2));
    timing.restart();
    assert_eq!((timing.max(), timing.overruns()), (Duration::ZERO, 2));
}

#[test]
fn a_goal_beyond_reach_is_taken_and_reported() {
    let mut bench = Bench::new();
    bench.servo.take_goal([3.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0], "", bench.now).unwrap();
    bench.run(2.0);
    assert!(bench.servo.status().goal_beyond_reach);
}

#[test]
fn both_signs_of_a_goal_are_the_same_motion() {
    let goal = crate::reference::puma().forward_kinematics(&numbers(&json()["theta_desired"])).unwrap();
    let end = |goal: UnitDualQuaternion| {
        let mut bench = Bench::new();
        bench.set_law(Law::Diffc);
        bench.run(0.01);
        bench.goal_pose(&goal);
        bench.run(0.5);
        bench.plants[0].positions().to_vec()
    };
    let distance = crate::reference::distance(&end(goal), &end(-goal));
    assert!(distance < 1e-9, "{distance}");
}

#[test]
fn limits_that_do_not_fit_the_arm_are_refused() {
    let mut parameters = parameters();
    parameters.settings.limits.joint_velocity.pop();
    assert!(Servo::new(parameters.task, parameters.joints, "", parameters.settings, PERIOD).is_err());
}

/// What may happen to a servo.
#[derive(Clone, Debug)]
enum Event {
    Goal([f64; 3], [f64; 4]),
    Law(usize),
    Pause(bool),
    Stop,
    Connect(bool),
    Limits(f64, f64),
    Cycles(usize),
}

fn any_event() -> impl Strategy<Value = Event> {
    prop_oneof![
        (prop::array::uniform3(-1.0..1.0f64), prop::array::uniform4(-1.0..1.0f64))
            .prop_map(|(p, q)| Event::Goal(p, q)),
        (0..3usize).prop_map(Event::Law),
        any::<bool>().prop_map(Event::Pause),
        Just(Event::Stop),
        any::<bool>().prop_map(Event::Connect),
        (0.01..5.0f64, 0.1..100.0f64).prop_map(|(v, a)| Event::Limits(v, a)),
        (1..80usize).prop_map(Event::Cycles),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn no_order_of_events_breaks_a_limit(events in prop::collection::vec(any_event(), 1..40)) {
        let mut bench = Bench::new();
        for event in events {
            match event {
                Event::Goal(p, q) => {
                    let norm = q.iter().map(|x| x * x).sum::<f64>().sqrt();
                    let now = bench.now;
                    let _: Result<(), Rejection> = bench.servo.take_goal(p, q.map(|x| x / norm), "", now);
                }
                Event::Law(i) => bench.set_law([Law::Diffc, Law::Logc, Law::DoubleGeodesic][i]),
                Event::Pause(paused) => bench.servo.pause(paused),
                Event::Stop => bench.servo.stop(),
                Event::Connect(connected) => bench.connect(connected),
                Event::Limits(velocity, acceleration) => {
                    bench.change(|settings| {
                        settings.limits.joint_velocity = vec![velocity; 6];
                        settings.limits.joint_acceleration = vec![acceleration; 6];
                    });
                }
                Event::Cycles(count) => (0..count).for_each(|_| bench.cycle()),
            }
        }
        bench.cycle();
    }

    #[test]
    fn goals_of_any_numbers_are_taken_or_rejected(p in prop::array::uniform3(any::<f64>()), q in prop::array::uniform4(any::<f64>())) {
        if let Ok(goal) = Goal::new(p, q, "", "base") {
            prop_assert!(goal.base_from_goal().to_vector8().iter().all(|x| x.is_finite()));
        }
    }
}
