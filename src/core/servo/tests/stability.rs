//! Tests of [`largest_rate`].

use crate::servo::stability::*;
use std::f64::consts::PI;
use std::time::Duration;

/// Returns whether an error decays under a law with `rate` [1/s] and a delay of `delay` cycles of 2 ms.
fn decays(rate: f64, delay: usize) -> bool {
    let mut errors = vec![1.0; delay + 1];
    for cycle in delay..delay + 20_000 {
        errors.push(errors[cycle] - 0.002 * rate * errors[cycle - delay]);
    }
    let largest = |errors: &[f64]| errors.iter().fold(0.0_f64, |most, error| most.max(error.abs()));
    largest(&errors[errors.len() - 4000..]) < largest(&errors[4000..8000])
}

#[test]
fn below_the_largest_rate_errors_decay_and_above_they_grow() {
    for delay in [0, 1, 2, 10, 50] {
        let latency = Duration::from_millis(2) * u32::try_from(delay).unwrap();
        let largest = largest_rate(latency, Duration::from_millis(2));
        assert!(decays(0.98 * largest, delay) && !decays(1.02 * largest, delay), "{delay}: {largest}");
    }
}

#[test]
fn for_short_periods_the_largest_rate_is_a_quarter_turn_over_the_delay() {
    let largest = largest_rate(Duration::from_millis(100), Duration::from_micros(100));
    assert!((largest - PI / (2.0 * 0.10005)).abs() < 1e-4, "{largest}");
}

#[test]
fn without_a_period_the_largest_rate_is_the_limit_of_short_periods() {
    let late = Duration::from_millis(100);
    let (short, none) = (largest_rate(late, Duration::from_nanos(1)), largest_rate(late, Duration::ZERO));
    assert!((none - short).abs() < 1e-6, "{none} {short}");
    assert_eq!(largest_rate(Duration::ZERO, Duration::ZERO), f64::INFINITY);
}
