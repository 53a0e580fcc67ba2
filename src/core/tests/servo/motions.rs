//! Tests of the servo's record of its motions.

use crate::reference::{moved_by, pose};
use crate::rig::{Rig, reading};
use dq_algebra::UnitDualQuaternion;
use dq_core::servo::{
    GoalMotion, GoalReading, MOTIONS, Outcome, Requester, Revocation, STREAM, Sent, Stall, State,
};
use nalgebra::Vector3;
use std::time::Duration;

type Motion = dq_core::servo::Motion;

/// Sends a goal of the publisher `by`.
fn send(rig: &mut Rig, pose: &UnitDualQuaternion, by: u32, stamp: i64) {
    let sent = Sent { by, ago: Duration::ZERO };
    rig.take_goal(&GoalReading { sent, ..reading(pose, stamp) }).unwrap();
}

/// Returns the numbers and outcomes of the motions recorded since the last call.
fn updates(rig: &mut Rig) -> Vec<(u64, Outcome)> {
    rig.servo.take_motions().map(|motion| (motion.number, motion.outcome)).collect()
}

#[test]
fn a_motion_is_recorded_when_it_begins_and_when_it_arrives_and_what_the_arm_does_then_belongs_to_none() {
    let mut rig = Rig::new();
    rig.run(0.1);
    let start = rig.servo.pose().unwrap();
    send(&mut rig, &pose("theta_desired"), 3, 77);
    rig.cycle();
    let begun: Vec<Motion> = rig.servo.take_motions().collect();
    let [begun] = begun.as_slice() else { panic!("{begun:?}") };
    assert_eq!(
        (begun.number, begun.outcome, begun.stamp, begun.asker),
        (1, Outcome::Underway, 77, Requester::Goal(3))
    );
    assert!((begun.start.unwrap().to_vector8() - start.to_vector8()).norm() < 1e-12);
    rig.run_until(State::Settled, 30.0);
    let at_arrival = rig.servo.status().figures;
    let ended: Vec<Motion> = rig.servo.take_motions().collect();
    let [ended] = ended.as_slice() else { panic!("{ended:?}") };
    assert_eq!((ended.number, ended.outcome, ended.figures), (1, Outcome::Arrived, at_arrival));
    assert_eq!(at_arrival.arrival_time, Some(at_arrival.elapsed));
    // The paper's motion crosses a singularity, and joint 3 reaches its velocity limit.
    assert!(at_arrival.smallest_singular_value.unwrap() < 1e-2, "{at_arrival:?}");
    let peak = ended.peak_speeds.iter().copied().fold(0.0, f64::max);
    let limits = &rig.servo.settings().limits.joint_velocity;
    assert!((peak - at_arrival.peak_joint_speed / limits[2]).abs() < 1e-12, "{:?}", ended.peak_speeds);
    rig.run(1.0);
    rig.stop();
    rig.run(0.5);
    assert_eq!(updates(&mut rig), []);
}

#[test]
fn goals_of_one_publisher_that_follow_each_other_are_one_motion_which_arrives_once_they_have_ceased() {
    let mut rig = Rig::new();
    for i in 0..20 {
        send(&mut rig, &moved_by(&pose("theta_desired"), 0.002 * f64::from(i)), 0, i64::from(i));
        rig.run(0.5);
    }
    assert_eq!(updates(&mut rig), [(1, Outcome::Underway)]);
    rig.run_until(State::Settled, 30.0);
    rig.run(STREAM.as_secs_f64());
    let ended: Vec<Motion> = rig.servo.take_motions().collect();
    let [ended] = ended.as_slice() else { panic!("{ended:?}") };
    assert_eq!((ended.number, ended.outcome, ended.stamp), (1, Outcome::Arrived, 19));
    // A goal of another publisher, or with a later stamp, begins another motion even at the same pose.
    send(&mut rig, &moved_by(&pose("theta_desired"), 0.038), 1, 20);
    rig.run(STREAM.as_secs_f64() + 0.1);
    send(&mut rig, &moved_by(&pose("theta_desired"), 0.038), 1, 21);
    rig.cycle();
    let both = [Outcome::Underway, Outcome::Arrived];
    let expected: Vec<_> =
        [2, 3].into_iter().flat_map(|number| both.map(|outcome| (number, outcome))).collect();
    assert_eq!(updates(&mut rig), expected);
    assert_eq!(rig.servo.status().figures.path_length, 0.0);
}

/// The goal moves back and forth by 2 mm each second. The tolerance is 1 mm.
#[test]
fn a_goal_that_moves_with_its_frame_is_arrived_at_though_it_moves() {
    let mut rig = Rig::new();
    send(&mut rig, &pose("theta_desired"), 0, 0);
    for second in 0..12 {
        let goal = moved_by(&pose("theta_desired"), 0.002 * f64::from(second % 2));
        rig.servo.move_goal(&GoalMotion::To(reading(&goal, 0)), rig.now).unwrap();
        rig.run(1.0);
    }
    assert_eq!(updates(&mut rig), [(1, Outcome::Underway), (1, Outcome::Arrived)]);
}

#[test]
fn a_motion_that_does_not_arrive_says_why() {
    let begun = || {
        let mut rig = Rig::new();
        send(&mut rig, &pose("theta_desired"), 0, 1);
        rig.run(0.5);
        updates(&mut rig);
        rig
    };
    let mut rig = begun();
    send(&mut rig, &moved_by(&pose("theta_desired"), 0.1), 1, 2);
    assert_eq!(updates(&mut rig), [(1, Outcome::Replaced)]);
    let mut rig = begun();
    rig.stop();
    rig.run(0.1);
    assert_eq!(updates(&mut rig), [(1, Outcome::Revoked(Revocation::Stopped))]);
    let mut rig = begun();
    rig.twist([0.0, 0.0, 0.05], [0.0; 3], "").unwrap();
    rig.cycle();
    assert_eq!(updates(&mut rig), [(1, Outcome::Revoked(Revocation::Jogged))]);
    let mut rig = begun();
    rig.connect(false);
    rig.run(2.0);
    rig.connect(true);
    rig.run(0.1);
    let ended = updates(&mut rig);
    assert!(matches!(ended[..], [(1, Outcome::Revoked(Revocation::WasAway(_)))]), "{ended:?}");
    rig.pause(false);
    rig.cycle();
    assert_eq!(updates(&mut rig), [(2, Outcome::Underway)], "asked for once more");
}

#[test]
fn a_motion_that_stalls_goes_on_where_something_changes() {
    let mut rig = Rig::with(|settings| settings.progress_timeout = Some(Duration::from_secs(1)));
    let far = UnitDualQuaternion::from_parts(pose("theta_desired").rotation(), Vector3::new(0.0, 0.0, -0.86));
    rig.change(|settings| settings.beyond_reach = dq_core::servo::BeyondReach::Approach);
    send(&mut rig, &far, 0, 1);
    rig.run_until(State::Stalled, 60.0);
    // By then the arm stands, and the search for another configuration has ended.
    rig.run(1.1);
    let ended: Vec<Motion> = rig.servo.take_motions().collect();
    let last = ended.last().unwrap();
    assert!(
        matches!(last.outcome, Outcome::Stalled(Stall::BeyondReach(_) | Stall::Unreachable)),
        "{ended:?}"
    );
    assert_eq!(last.figures.stalls, 1.0);
    rig.set_law(dq_kinematics::control::Law::Diffc);
    rig.cycle();
    rig.run_until(State::Stalled, 60.0);
    rig.run(1.1);
    let again: Vec<Motion> = rig.servo.take_motions().collect();
    assert_eq!(again.last().map(|motion| (motion.number, motion.figures.stalls)), Some((1, 2.0)));
}

#[test]
fn of_motions_that_nobody_asks_for_the_last_are_kept() {
    let mut rig = Rig::new();
    for by in 0..200 {
        send(&mut rig, &moved_by(&pose("theta_desired"), 0.01 * f64::from(by % 5)), by, 0);
        rig.cycle();
    }
    let kept: Vec<Motion> = rig.servo.take_motions().collect();
    assert_eq!((kept.len(), kept.last().map(|motion| motion.number)), (MOTIONS, Some(200)));
}
