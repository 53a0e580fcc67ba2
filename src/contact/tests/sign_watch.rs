//! Tests of the detection of a wrong sign: at a wall, at a wall with an inverted sensor, and with a person who pushes.

use crate::sign_watch::SignWatch;
use nalgebra::Vector3;

const DT: f64 = 0.002;

/// Moves a tool along a skew direction into a wall with this `stiffness` \[N/m\]. The sensor reports the force with the factor
/// `sign` and with `noise` \[N\]. The tool's speed is 5 cm/s plus 1/300 m/s per newton of reported force. Returns the time from the
/// first touch until the wrong sign is detected \[s\]; `None` if it is not detected.
fn contact(stiffness: f64, sign: f64, noise: f64) -> Option<f64> {
    let (mut watch, mut depth) = (SignWatch::default(), -0.01);
    let direction = Vector3::new(0.6, 0.0, -0.8);
    let (mut touched, mut random) = (None, 1_u64);
    for step in 0..600 {
        random = random.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        let jitter = noise * ((random >> 33) as f64 / f64::from(1_u32 << 31) * 2.0 - 1.0);
        let force = -sign * stiffness * f64::max(depth, 0.0) + jitter;
        let speed = 0.05 + force / 300.0;
        depth = (depth + DT * speed).min(0.05);
        let time = f64::from(step) * DT;
        if depth > 0.0 {
            touched = touched.or(Some(time));
        }
        if watch.update(&(force * direction), &(speed * direction), 1.0, DT) {
            return touched.map(|touched| time - touched);
        }
    }
    None
}

#[test]
fn an_inverted_sensor_is_found_within_half_a_second_of_contact_and_a_right_one_never() {
    for stiffness in [1e3, 1e4, 1e5] {
        for noise in [0.0, 0.8] {
            assert_eq!(contact(stiffness, 1.0, noise), None, "{stiffness} {noise}");
            let found = contact(stiffness, -1.0, noise).unwrap();
            assert!(found < 0.5, "{stiffness} {noise}: {found}");
        }
    }
}

#[test]
fn a_person_who_pushes_an_arm_that_stands_gives_no_verdict() {
    let mut watch = SignWatch::default();
    for step in 0..1000 {
        let force = 30.0 * (f64::from(step) * 0.01).sin().abs();
        let velocity = Vector3::x() * f64::max(force - 1.0, 0.0) / 300.0;
        assert!(!watch.update(&(force * Vector3::x()), &velocity, 1.0, DT), "{step}");
    }
}
