//! Tests of one goal after another, and of streams of goals.

use crate::reference::{moved_by, pose};
use crate::rig::{PERIOD, Rig};
use dq_algebra::UnitDualQuaternion;
use dq_core::servo::State;
use nalgebra::Vector3;
use std::time::Duration;

fn turned(pose: &UnitDualQuaternion, by: f64) -> UnitDualQuaternion {
    *pose * UnitDualQuaternion::from_translation_angle_axis(Vector3::zeros(), by, &Vector3::z_axis())
}

/// Streams the goals that `goal` returns, one per cycle.
fn stream(rig: &mut Rig, seconds: f64, mut goal: impl FnMut(usize) -> UnitDualQuaternion) {
    for i in 0..(seconds / PERIOD.as_secs_f64()) as usize {
        rig.stream(&goal(i));
        rig.cycle();
    }
}

#[test]
fn the_slack_of_a_settled_arm_is_for_its_goal_and_not_for_the_next() {
    let mut rig = Rig::new();
    rig.goal_pose(&pose("theta_desired"));
    rig.run(20.0);
    assert_eq!(rig.state(), State::Settled);
    // The goal is 1.5 mm away; the tolerance is 1 mm.
    let there = rig.servo.pose().unwrap();
    rig.goal_pose(&moved_by(&there, 0.0015));
    rig.cycle();
    assert_eq!(rig.state(), State::Tracking);
    rig.run_until(State::Settled, 10.0);
    let figures = rig.servo.status().figures;
    assert!(figures.arrival_time.unwrap() > 0.0 && figures.position_error <= 0.001, "{figures:?}");
    // An arm that has settled stays settled within twice its tolerances.
    let mut settled = rig.servo.pose().unwrap();
    settled = moved_by(&settled, 0.0005);
    rig.goal_pose(&settled);
    rig.cycle();
    assert_eq!(rig.state(), State::Settled);
}

/// Returns a rig whose arm cannot reach its goal. Joint 3 has to go from 2.36 to 1.05 rad, and its limit is 1.6 rad.
fn held() -> Rig {
    Rig::with(|settings| {
        settings.progress_timeout = Some(Duration::from_secs(1));
        settings.limits.position.lower[2] = 1.6;
    })
}

#[test]
fn both_signs_of_a_goal_are_one_goal_and_do_not_defeat_the_stall_watch() {
    let mut rig = held();
    stream(&mut rig, 8.0, |i| if i % 2 == 0 { pose("theta_desired") } else { -pose("theta_desired") });
    assert_eq!((rig.state(), rig.servo.status().goal_count), (State::Stalled, 1));
}

#[test]
fn a_stream_of_goals_that_cannot_be_told_apart_is_one_motion() {
    let mut rig = Rig::new();
    stream(&mut rig, 8.0, |i| moved_by(&pose("theta_desired"), [0.0, 2e-4, -3e-4][i % 3]));
    let status = rig.servo.status();
    assert_eq!((status.state, status.goal_count), (State::Settled, 1));
    // As for a goal that is sent once: 6.6 s and 0.63 m.
    assert!((status.figures.arrival_time.unwrap() - 6.6).abs() < 0.3, "{:?}", status.figures);
    assert!((status.figures.path_length - 0.633).abs() < 0.01, "{:?}", status.figures);
}

#[test]
fn a_stream_that_shakes_does_not_defeat_the_stall_watch_but_one_that_moves_does() {
    let stalls = |goal: fn(usize) -> UnitDualQuaternion| {
        let mut rig = held();
        stream(&mut rig, 8.0, goal);
        rig.state() == State::Stalled
    };
    // The goal swings by 6 mm; its distance is half a metre.
    assert!(stalls(|i| moved_by(&pose("theta_desired"), [0.0, 3e-3, -3e-3][i % 3])));
    // The goal moves at 0.1 m/s, so that each goal differs from the previous goal.
    assert!(!stalls(|i| moved_by(&pose("theta_desired"), 0.1 * i as f64 * PERIOD.as_secs_f64())));
}

#[test]
fn after_a_stall_another_goal_that_is_no_stream_is_tried_however_near_it_is() {
    let mut rig = held();
    rig.goal_pose(&pose("theta_desired"));
    rig.run_until(State::Stalled, 8.0);
    rig.goal_pose(&moved_by(&pose("theta_desired"), 0.01));
    rig.cycle();
    assert!(rig.state() != State::Stalled);
}

#[test]
fn a_stream_near_half_a_turn_keeps_its_sign() {
    let mut rig = Rig::new();
    rig.run(0.01);
    let start = rig.servo.pose().unwrap();
    rig.following = false;
    let mut signs = Vec::new();
    let mut before = None;
    let half = std::f64::consts::PI;
    // The goal swings about half a turn by 3°; the hysteresis is 11.5°.
    stream(&mut rig, 0.2, |i| turned(&start, half + [-0.05, 0.05][i % 2]));
    for i in 0..100 {
        rig.stream(&turned(&start, half + [-0.05, 0.05][i % 2]));
        rig.cycle();
        // The direction in which the law turns: the axis of the error, which is reversed with the sign.
        let axis = rig.servo.status().pose_error.fixed_rows::<3>(0).into_owned();
        if let Some(before) = before.replace(axis) {
            signs.push(axis.dot(&before) > 0.0);
        }
    }
    assert!(signs.iter().all(|same| *same), "{signs:?}");
    // Far beyond the hysteresis, the law takes the nearer side.
    stream(&mut rig, 0.2, |_| turned(&start, half + 0.5));
    assert!(rig.servo.status().pose_error.fixed_rows::<3>(0).norm() < half);
}
