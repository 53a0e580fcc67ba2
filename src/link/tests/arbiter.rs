//! Tests of [`Arbiter`].

use crate::arbiter::*;
use std::time::Duration;

const MS: Duration = Duration::from_millis(1);
const SILENCE: Duration = Duration::from_millis(100);

#[test]
fn two_publishers_that_alternate_are_rivals_until_one_is_silent() {
    let mut arbiter = Arbiter::default();
    assert!(arbiter.hear(0, MS, SILENCE));
    assert!(!arbiter.hear(1, 2 * MS, SILENCE));
    assert_eq!(arbiter.rivals(2 * MS), None, "the first may have gone");
    assert!(arbiter.hear(0, 3 * MS, SILENCE));
    assert_eq!(arbiter.rivals(3 * MS), Some([0, 1]));
    assert!(!arbiter.hear(1, 4 * MS, SILENCE));
    assert_eq!(arbiter.rivals(500 * MS), Some([0, 1]), "both were there within the second");
    assert!(arbiter.hear(0, 900 * MS, SILENCE));
    assert_eq!(arbiter.rivals(1200 * MS), None);
}

#[test]
fn a_publisher_that_begins_after_another_has_gone_takes_over() {
    let mut arbiter = Arbiter::default();
    arbiter.hear(0, MS, SILENCE);
    assert!(!arbiter.hear(1, 50 * MS, SILENCE));
    assert!(arbiter.hear(1, 102 * MS, SILENCE));
    assert!(arbiter.hear(1, 104 * MS, SILENCE));
    assert_eq!(arbiter.rivals(104 * MS), None);
}

#[test]
fn a_slow_publisher_alongside_a_fast_one_is_a_rival_too() {
    let mut arbiter = Arbiter::default();
    arbiter.hear(0, MS, SILENCE);
    assert!(arbiter.hear(1, 201 * MS, SILENCE));
    arbiter.hear(1, 203 * MS, SILENCE);
    assert!(!arbiter.hear(0, 204 * MS, SILENCE));
    assert!(arbiter.hear(1, 205 * MS, SILENCE));
    assert_eq!(arbiter.rivals(205 * MS), Some([1, 0]));
}
