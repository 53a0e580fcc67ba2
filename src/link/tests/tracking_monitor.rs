//! Tests of [`TrackingMonitor`].

use super::MS;
use crate::command_history::CommandHistory;
use crate::tracking_monitor::*;
use dq_kinematics::arm::JointKind;
use dq_limits::Interface;
use proptest::prelude::*;
use std::time::Duration;

/// Returns the time at which an arm is first judged lost, if ever. Each of `pieces` has the commands of the arm's two revolute
/// joints for 50 ms [rad/s]. After `delay` \[ms\], the joints move at these speeds times the fractions `parts`.
fn lost_after(pieces: &[[f64; 2]], delay: usize, parts: [f64; 2]) -> Option<Duration> {
    let kinds = [JointKind::Revolute; 2];
    let mut history = CommandHistory::new(2, MS, Interface::Velocity);
    let mut monitor = TrackingMonitor::new(0..2);
    let mut positions = [0.0; 2];
    (0..50 * pieces.len()).find_map(|cycle| {
        let now = u32::try_from(cycle).unwrap() * MS;
        monitor.watch_responses(now, &positions, &kinds, &history, (Duration::ZERO, &[0.0; 2]));
        let command = pieces[cycle / 50];
        history.note(now, &command, &[0.0; 2]);
        monitor.command(now, command.into_iter());
        if let Some(at_work) = cycle.checked_sub(delay) {
            let speeds = pieces[at_work / 50];
            (0..2).for_each(|joint| positions[joint] += 1e-3 * parts[joint] * speeds[joint]);
        }
        monitor.is_lost().then_some(now)
    })
}

/// Returns random commands for two joints, as [`lost_after`] takes them, for two to four seconds. Their speeds are at most 0.05 rad/s,
/// which is the speed limit for a joint that has not yet responded.
fn pieces() -> impl Strategy<Value = Vec<[f64; 2]>> {
    let speed = || prop_oneof![Just(0.0), -0.05..0.05, -0.005..0.005];
    prop::collection::vec([speed(), speed()], 40..80)
}

#[test]
fn a_joint_that_begins_when_the_others_go_back_follows() {
    let (up, down, both) = ([[0.5, 0.0]; 40], [[-0.5, 0.0]; 15], [[-0.5, 0.01]; 15]);
    let pieces = [&up[..], &down, &both].concat();
    assert_eq!(lost_after(&pieces, 10, [1.0; 2]), None);
}

#[test]
fn a_joint_that_begins_when_another_has_turned_by_more_than_half_a_turn_follows() {
    let (first, both) = ([[2.0, 0.0]; 40], [[2.0, 0.01]; 15]);
    let pieces = [&first[..], &both].concat();
    assert_eq!(lost_after(&pieces, 5, [1.0; 2]), None);
}

#[test]
fn a_joint_that_moves_back_and_forth_within_the_delay_and_again_long_after_follows() {
    let pieces: Vec<_> = (0..40).map(|piece| [0.05, [0.05, -0.05, 0.0][piece.min(2)]]).collect();
    let pieces = [pieces, vec![[0.05, -0.05]; 20]].concat();
    assert_eq!(lost_after(&pieces, 110, [1.0; 2]), None);
}

proptest! {
    #[test]
    fn an_arm_that_obeys_late_follows(pieces in pieces(), delay in 0..100usize, part in 0.2..1.0f64) {
        prop_assert_eq!(lost_after(&pieces, delay, [part; 2]), None);
    }

    #[test]
    fn a_joint_that_stands_although_commanded_to_move_is_lost(pieces in pieces(), delay in 0..100usize) {
        let pieces: Vec<_> = pieces.iter().map(|[one, _]| [*one, 0.05]).collect();
        let lost = lost_after(&pieces, delay, [1.0, 0.0]);
        prop_assert!(lost.is_some_and(|after| after <= 450 * MS), "{lost:?}");
    }
}
