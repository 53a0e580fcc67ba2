//! Tests of [`Progress`].

use crate::servo::progress::*;
use dq_metrics::{GoalError, Tolerance};
use std::time::Duration;

const TOLERANCE: Tolerance = Tolerance { linear: 1e-3, angular: 1e-2 };

/// Returns the longest time without progress in a motion of `seconds`. `position` gives the position error at each time. The
/// rotation error is within its tolerance.
fn longest(seconds: f64, position: impl Fn(f64) -> f64) -> f64 {
    let error = |time: f64| GoalError { position: position(time), rotation: 5e-3 - 1e-5 * time };
    // The law's error is constant, so that only the position error counts.
    let mut progress = Progress::new(SHARE);
    let times = (0..).map(|cycle| 0.01 * f64::from(cycle)).take_while(|time| *time <= seconds);
    let without = times
        .filter(|time| position(*time) > TOLERANCE.linear)
        .map(|time| progress.update(Duration::from_millis(10), error(time), 0.0, &TOLERANCE).as_secs_f64());
    without.fold(0.0, f64::max)
}

#[test]
fn a_slow_law_that_arrives_makes_progress_all_the_way() {
    // Gains of 1 and 0.003 1/s, and a linear speed of 0.3 mm/s.
    assert!(longest(10.0, |t| 0.5 * (-t).exp()) < 0.1);
    assert!(longest(2400.0, |t| 0.5 * (-0.003 * t).exp()) < 4.0);
    assert!(longest(2000.0, |t| 0.5 - 3e-4 * t) < 5.0);
}

#[test]
fn trading_one_error_for_the_other_is_progress_if_the_laws_error_shrinks() {
    let mut progress = Progress::new(SHARE);
    progress.update(Duration::ZERO, GoalError { position: 0.0, rotation: 0.4 }, 0.4, &TOLERANCE);
    for second in 1..30_u32 {
        let fading = (-0.2 * f64::from(second)).exp();
        let error = GoalError { position: 0.3 * fading, rotation: 5e-3 };
        let without = progress.update(Duration::from_secs(1), error, 0.35 * fading, &TOLERANCE);
        assert_eq!(without, Duration::ZERO);
    }
}

#[test]
fn creeping_is_not_progress() {
    // 10 µm in 5 s, a tenth of a meter from the goal: it would take half a day.
    assert!(longest(20.0, |t| 0.1 - 2e-6 * t) > 15.0);
    // The error approaches 20 mm; the goal is out of reach.
    assert!(longest(20.0, |t| 0.02 + 0.5 * (-t).exp()) > 8.0);
    assert!(longest(400.0, |t| 0.02 + 0.1 / (1.0 + t)) > 10.0);
}
