//! Tests of [`ErrorTrend`].

use crate::servo::error_trend::*;
use nalgebra::Vector6;
use std::time::Duration;

/// Yields, for every cycle from 1 s on, the error `of(time)` and the predicted error, in mm along x.
fn leads(of: impl Fn(f64) -> f64) -> impl Iterator<Item = (f64, f64)> {
    let mut trend = ErrorTrend::default();
    (0..1500).filter_map(move |cycle| {
        let now = Duration::from_millis(2) * cycle;
        let log = Vector6::new(0.0, 0.0, 0.0, 1e-3 * of(now.as_secs_f64()), 0.0, 0.0);
        trend.note(now, &log);
        let there = trend.leads_to(now, &log, 0.25).translation().x;
        (now.as_secs_f64() >= 1.0).then_some((of(now.as_secs_f64()), 1e3 * there))
    })
}

#[test]
fn an_error_that_decays_stays_inside() {
    assert!(leads(|time| 500.0 * (-4.0 * time).exp()).all(|(now, then)| then.abs() <= now.abs()));
}

#[test]
fn an_error_that_passes_through_does_not_stay_inside() {
    for rest in [1.01, 1.2, 3.5, 70.0] {
        let passes = leads(|time| 500.0 * (-4.0 * time).exp() - rest);
        assert!(passes.filter(|(now, _)| now.abs() <= 1.0).all(|(_, then)| then.abs() > 1.0), "{rest}");
    }
}

#[test]
fn a_single_error_leads_to_itself() {
    let log = Vector6::new(0.0, 0.0, 0.0, 1e-3, 0.0, 0.0);
    let there = ErrorTrend::default().leads_to(Duration::ZERO, &log, 0.25);
    assert!((there.translation().x - 1e-3).abs() < 1e-12);
}
