//! Tests of [`Lateness`].

use crate::lateness::*;
use std::time::Duration;

#[test]
fn the_worst_is_bounded_and_forgotten() {
    let ms = Duration::from_millis;
    let mut lateness = Lateness::default();
    lateness.note(ms(1000), ms(30));
    lateness.note(ms(1010), ms(20));
    lateness.note(ms(2999), ms(5));
    assert_eq!(lateness.worst(), ms(30));
    lateness.note(ms(3999), ms(7));
    assert_eq!(lateness.worst(), ms(30), "of the window before");
    lateness.note(ms(5000), ms(0));
    assert_eq!(lateness.worst(), ms(7));
    lateness.note(ms(60_000), ms(500));
    assert_eq!(lateness.worst(), LONGEST_HOLD);
    lateness.note(ms(120_000), ms(1));
    assert_eq!(lateness.worst(), ms(1));
}
