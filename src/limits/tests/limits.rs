//! Tests of one joint's envelope under any motion and any limits.

use crate::{Braking, Joints, LatchedLimits, Limits, Pace, PositionLimits, Span, Violation};
use proptest::prelude::*;

const PERIOD: f64 = 0.001;

/// Returns the limits of one joint: 1 rad/s; 10 rad/s² to accelerate and 20 to decelerate; positions from −1 to 1 rad; and `jerk`.
fn limits(jerk: f64) -> Limits {
    Limits {
        joint_velocity: vec![1.0],
        joint_acceleration: vec![10.0],
        joint_deceleration: vec![20.0],
        joint_jerk: vec![jerk],
        linear_speed: 1.0,
        angular_speed: 1.0,
        position: PositionLimits { lower: vec![-1.0], upper: vec![1.0], margin: 0.1 },
    }
}

fn span(limits: &Limits, position: f64, pace: Pace) -> Span {
    let [decelerations, jerks] = [[limits.deceleration(0)], [limits.jerk(0)]];
    let (steps, period) = ([pace.step], PERIOD);
    let braking = Braking {
        decelerations: &decelerations,
        jerks: &jerks,
        steps: &steps,
        period,
        cycle: period,
        delay: 0.0,
    };
    Joints { limits, positions: &[position], before: &[pace.speed], hold: &[0.0], braking }.span(0)
}

fn exponent(range: std::ops::Range<f64>) -> impl Strategy<Value = f64> {
    range.prop_map(|exponent| 10f64.powf(exponent))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn a_stop_is_always_in_the_envelope(
        (velocity, acceleration, deceleration) in (exponent(-6.0..4.0), exponent(-6.0..4.0), exponent(-6.0..4.0)),
        jerk in prop_oneof![Just(f64::INFINITY), exponent(0.0..5.0)],
        (position, speed, step) in (-2.0..2.0f64, -6.0..6.0f64, -1.0..1.0f64),
        wanted in prop::num::f64::ANY,
    ) {
        let limits = Limits {
            joint_velocity: vec![velocity],
            joint_acceleration: vec![acceleration],
            joint_deceleration: vec![deceleration],
            ..limits(jerk)
        };
        let pace = Pace { speed, step };
        let span = span(&limits, position, pace);
        prop_assert_eq!(span.violation(0, pace.stopped(limits.deceleration(0) * PERIOD, limits.jerk(0) * PERIOD * PERIOD)), None);
        prop_assert_eq!(span.violation(0, span.hold(wanted)).is_some(), wanted.is_nan());
    }

    /// A joint that moves at its largest allowed speed in every cycle stops at its position limit.
    #[test]
    fn a_joint_at_its_largest_allowed_speed_stops_before_its_limit(
        jerk in prop_oneof![Just(f64::INFINITY), exponent(2.0..4.0)],
        (start, margin) in (-1.0..0.9f64, 0.0..0.5f64),
    ) {
        let mut limits = limits(jerk);
        limits.position.margin = margin;
        let (mut pace, mut position) = (Pace::default(), start);
        for _ in 0..10_000 {
            let (_, speed) = span(&limits, position, pace).next;
            pace = Pace { speed, step: speed - pace.speed };
            position += PERIOD * speed;
            prop_assert!(position <= 1.0, "at {position} rad, {pace:?}");
        }
        prop_assert!(position > 0.98, "{position} rad");
    }
}

#[test]
fn a_speed_outside_of_the_envelope_is_reported() {
    let span = span(&limits(f64::INFINITY), 0.0, Pace { speed: 0.3, step: 0.0 });
    let [too_fast, too_hard] = [0.311, 0.279].map(|speed| span.violation(0, speed));
    assert!(matches!(too_fast, Some(Violation::Envelope { joint: 1, .. })), "{too_fast:?}");
    assert!(matches!(too_hard, Some(Violation::Envelope { joint: 1, .. })), "{too_hard:?}");
    assert!(matches!(span.violation(0, f64::NAN), Some(Violation::NonFinite { joint: 1, .. })));
    assert_eq!([0.309, 0.281].map(|speed| span.violation(0, speed)), [None, None]);
}

#[test]
fn a_limit_lowered_in_motion_applies_once_the_joint_stands() {
    let (strong, weak) = (limits(5000.0), Limits { joint_deceleration: vec![1.0], ..limits(300.0) });
    let mut latched = LatchedLimits::new(&strong);
    let mut after = |limits: &Limits, speed: f64| {
        latched.update(limits, &[speed], &[0.0]);
        latched.each().map(|of_each| of_each[0])
    };
    assert_eq!(after(&strong, 0.3), [20.0, 5000.0, 0.3]);
    // The lowered limits have no effect yet when the joint reverses, nor in the cycle in which it comes to rest.
    for (speed, step) in [(0.2, -0.1), (-0.1, -0.3), (0.0, 0.1)] {
        let [deceleration, jerk, change] = after(&weak, speed);
        assert!((deceleration, jerk) == (20.0, 5000.0) && (change - step).abs() < 1e-12, "{speed}");
    }
    assert_eq!(after(&weak, 0.0), [1.0, 300.0, 0.0]);
}
