//! Tests of [`MotionRequests`].

use crate::servo::consent::*;
use crate::servo::revocation::{Contended, Revocation, Rivals};
use std::time::Duration;

const MS: Duration = Duration::from_millis(1);

/// Notes a goal of publisher `by` at the time `at` \[ms\], and takes it unless it is revoked. Returns the revocation.
fn goal(requests: &mut MotionRequests, by: u32, at: u32) -> Option<Revocation> {
    let request = requests.hear(Requester::Goal(by), Duration::ZERO, at * MS, STREAM, true);
    if request.revoked.is_none() {
        requests.take(request);
    }
    request.revoked
}

/// Resumes at the time `at` \[ms\]. Returns whether the current goal had been revoked.
fn resume(requests: &mut MotionRequests, at: u32) -> bool {
    requests.resume(at * MS, at * MS, STREAM).unwrap()
}

#[test]
fn a_stream_that_continues_after_a_revocation_is_rejected_until_it_pauses() {
    let mut requests = MotionRequests::default();
    assert!(!requests.consent().is_given(), "nobody has asked");
    assert_eq!(goal(&mut requests, 0, 10), None);
    requests.stop(10 * MS);
    requests.stand();
    assert_eq!(goal(&mut requests, 0, 1500), Some(Revocation::Stopped), "a hole is no pause");
    assert_eq!(goal(&mut requests, 0, 3000), Some(Revocation::Stopped));
    assert_eq!(goal(&mut requests, 0, 4501), None);
    assert!(requests.consent().is_given());
}

#[test]
fn a_push_counts_if_it_was_sent_after_the_revocation() {
    let mut requests = MotionRequests::default();
    goal(&mut requests, 0, 10);
    requests.revoke(9 * MS, 20 * MS, Revocation::WasAway(1.0));
    assert!(requests.consent().is_given(), "it was sent later");
    requests.revoke(10 * MS, 20 * MS, Revocation::CameLater(0.0));
    assert_eq!(requests.consent().revocation(), Some(Revocation::CameLater(0.01)));
    let late = requests.hear(Requester::Goal(1), 12 * MS, 21 * MS, STREAM, true);
    assert_eq!(late.revoked, Some(Revocation::CameLater(0.011)));
    assert_eq!(goal(&mut requests, 2, 21), None);
    requests.revoke(21 * MS, 21 * MS, Revocation::AnotherTool);
    assert_eq!(requests.consent().revocation(), Some(Revocation::AnotherTool), "what comes later revokes");
}

#[test]
fn a_pause_holds_the_arm_and_its_end_asks_for_the_goal_again() {
    let mut requests = MotionRequests::default();
    requests.pause();
    goal(&mut requests, 0, 12);
    assert!(!requests.consent().is_given(), "a goal ends no pause");
    assert!(!resume(&mut requests, 13) && requests.consent().is_given());
    requests.revoke(20 * MS, 20 * MS, Revocation::FrameWasAway(2.0));
    assert!(resume(&mut requests, 30) && requests.consent().is_given());
    assert_eq!(requests.consent().request().map(|request| request.by), Some(Requester::Resume));
    assert!(!resume(&mut MotionRequests::default(), 30), "there is no goal");
}

#[test]
fn a_twist_revokes_goals_and_a_held_stick_asks_once() {
    let mut requests = MotionRequests::default();
    let twist = |requests: &mut MotionRequests, by, at: u32| {
        let request = requests.hear(Requester::Twist(by), Duration::ZERO, at * MS, STREAM, true);
        requests.jog(at * MS);
        requests.take(request);
        request.revoked
    };
    goal(&mut requests, 0, 5);
    assert_eq!(twist(&mut requests, 3, 10), None);
    assert_eq!(goal(&mut requests, 0, 20), Some(Revocation::Jogged));
    requests.stop(50 * MS);
    requests.stand();
    assert_eq!(twist(&mut requests, 3, 60), Some(Revocation::Stopped));
    assert!(
        !resume(&mut requests, 70) && !requests.consent().is_given(),
        "~/pause (false) releases no stick"
    );
    requests.release(Requester::Twist(3));
    assert_eq!(twist(&mut requests, 3, 80), None);
    assert!(requests.is_pushed(Requester::Twist(3), 81 * MS, STREAM));
}

#[test]
fn two_publishers_that_alternate_are_rivals_and_a_successor_is_not() {
    let mut requests = MotionRequests::default();
    goal(&mut requests, 0, 0);
    goal(&mut requests, 1, 500);
    goal(&mut requests, 1, 900);
    assert_eq!(requests.rivals(900 * MS, STREAM), None, "the first may have gone");
    goal(&mut requests, 0, 1000);
    let rivals = Rivals { of: Contended::Goals, first: 0, second: 1 };
    assert_eq!(requests.rivals(1000 * MS, STREAM), Some(rivals));
    requests.revoke(1000 * MS, 1000 * MS, Revocation::Rivals(Contended::Goals));
    goal(&mut requests, 0, 2000);
    assert_eq!(requests.rivals(2400 * MS, STREAM), Some(rivals), "as long as both are there");
    assert_eq!(requests.rivals(2401 * MS, STREAM), None);
}

#[test]
fn with_too_many_publishers_a_new_push_counts_as_revoked() {
    let mut requests = MotionRequests::default();
    requests.stop(MS);
    for by in 0..100 {
        assert_eq!(goal(&mut requests, by, 2), None, "single goals are no streams");
    }
    for at in [3, 4] {
        for by in 200..216 {
            goal(&mut requests, by, at);
        }
    }
    assert_eq!(requests.pushes.len(), MOST);
    assert_eq!(goal(&mut requests, 300, 5), Some(Revocation::Stopped));
}
