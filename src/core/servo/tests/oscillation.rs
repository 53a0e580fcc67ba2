//! Tests of [`Oscillation`].

use crate::servo::oscillation::*;
use std::f64::consts::TAU;
use std::time::Duration;

/// Returns the time \[s\] at which the monitor detects an oscillation with this frequency \[Hz\] and amplitude [rad/s,
/// prismatic: m/s]. The error oscillates by the fraction `part` of its size and shrinks at `rate` [1/s].
fn seen(frequency: f64, amplitude: f64, part: f64, rate: f64) -> Option<f64> {
    let mut oscillation = Oscillation::default();
    (0..5000).find_map(|cycle| {
        let now = Duration::from_millis(2) * cycle;
        let time = now.as_secs_f64();
        let swing = (TAU * frequency * time).sin();
        let command = [0.0, amplitude * swing + 0.3];
        let error = 0.1 * (1.0 + part * swing) * (-rate * time).exp();
        oscillation.update(now, &command, error).then_some(time)
    })
}

#[test]
fn oscillations_are_detected_within_3_s() {
    for (frequency, amplitude, part) in [(3.0, 0.05, 0.1), (5.0, 2.5, 0.0), (50.0, 0.05, 0.0)] {
        assert!(seen(frequency, amplitude, part, 0.0).unwrap() < 3.0, "{frequency} Hz, {amplitude} rad/s");
    }
    assert!(seen(5.0, 2.5, 0.0, 1.0).unwrap() < 3.0, "large ones also where the error shrinks");
}

#[test]
fn small_or_slow_swings_and_shrinking_errors_are_not_oscillations() {
    assert_eq!(seen(5.0, 0.02, 0.0, 0.0), None);
    assert_eq!(seen(1.0, 2.5, 0.5, 0.0), None);
    assert_eq!(seen(3.0, 2.5, 0.0, 0.0), None, "the error does not swing");
    assert_eq!(seen(3.0, 2.5, 0.1, 1.0), None, "the error shrinks");
    assert_eq!(seen(5.0, 0.2, 0.0, 1.0), None);
}
