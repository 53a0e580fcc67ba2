//! Tests of the jumps and absences of a robot.

use crate::presence::*;
use dq_kinematics::arm::JointKind;
use std::time::Duration;

const MS: Duration = Duration::from_millis(1);

fn step(before: Option<Duration>, now: Duration, to: f64) -> Option<Return> {
    step_of(JointKind::Revolute, before, now, to)
}

fn step_of(kind: JointKind, before: Option<Duration>, now: Duration, to: f64) -> Option<Return> {
    let (commanded, kinds) = (&[0.02], &[kind]);
    Step { before, now, from: &[0.0], to: &[to], speeds: &[2.0], commanded, kinds, first_joint: 7 }
        .returned(1000 * MS)
}

#[test]
fn a_robot_that_continues_has_not_returned() {
    assert_eq!(step(Some(5000 * MS), 5002 * MS, 0.1), None);
    assert_eq!(step(Some(5000 * MS), 5500 * MS, 1.0), None);
    assert_eq!(step(Some(5000 * MS), 5002 * MS, std::f64::consts::TAU + 0.01), None, "an encoder that wraps");
}

#[test]
fn a_joint_that_slides_has_no_turns() {
    let jump = std::f64::consts::TAU + 0.01;
    let what = Returned::IsElsewhere(7, jump, JointKind::Prismatic);
    let returned = step_of(JointKind::Prismatic, Some(5000 * MS), 5002 * MS, jump);
    assert_eq!(returned, Some(Return { since: Some(5000 * MS), what }));
}

#[test]
fn a_robot_that_was_away_or_jumped_has_returned() {
    let away = Return { since: Some(8000 * MS), what: Returned::WasAway(4.0) };
    assert_eq!(step(Some(5000 * MS), 9000 * MS, 0.0), Some(away));
    let elsewhere =
        Return { since: Some(5000 * MS), what: Returned::IsElsewhere(7, 1.2, JointKind::Revolute) };
    assert_eq!(step(Some(5000 * MS), 5400 * MS, 1.2), Some(elsewhere));
    assert_eq!(step(None, 9000 * MS, 0.0), Some(Return { since: Some(8000 * MS), what: Returned::Came }));
}
