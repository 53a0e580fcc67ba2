//! Tests of [`Pace`].

use crate::pace::*;
use proptest::prelude::*;

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn eased_steps_decrease_to_zero_at_the_desired_speed(gap in 1e-3..10.0f64, jerk in 1e-5..1.0f64) {
        let (mut pace, mut most) = (Pace { speed: 0.0, step: eased(gap, jerk) }, f64::INFINITY);
        for _ in 0..3000 {
            let step = pace.towards(gap, f64::INFINITY, jerk);
            pace = Pace { speed: pace.speed + step, step };
            prop_assert!(pace.speed <= gap + 1e-9 && step <= most + 1e-9, "{pace:?}");
            most = (step - jerk).max(0.0);
        }
        prop_assert!((pace.speed - gap).abs() < 1e-9 && pace.step.abs() < 1e-9, "{pace:?}");
    }
}
