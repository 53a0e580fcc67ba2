//! Tests of the number of gaps that the servo measures in a cycle if there are many keep-outs.

use super::keep_out::scene;
use dq_config::{NodeParameters, ServoParameters};
use dq_core::servo::{Measured, State};
use dq_space::space::MEASURED;
use nalgebra::Isometry3;

/// Returns sixty hulls of a hundred points each, on a circle of radius `away` \[m\] around the arm's base.
fn hulls(away: f64) -> Vec<String> {
    let hull = |i: u32| {
        let (sin, cos) = (0.7 * f64::from(i)).sin_cos();
        let point = |k: u32| {
            let (up, turn) = (1.0 - (f64::from(k) + 0.5) / 50.0, 2.4 * f64::from(k));
            let across = 0.05 * (1.0 - up * up).sqrt();
            let z = 0.1 * f64::from(i % 6) - 0.2 + 0.05 * up;
            format!(" {} {} {z}", away * cos + across * turn.cos(), away * sin + across * turn.sin())
        };
        format!("hull{i} hull{}", (0..100).map(point).collect::<String>())
    };
    (0..60).map(hull).collect()
}

/// Returns the largest number of gaps that a cycle measures on the way to a goal among [`hulls`]. The first cycle, which measures
/// all gaps, does not count.
fn most_measured(away: f64) -> usize {
    let (store, _) = ServoParameters::start("/dq_servo", Vec::new()).unwrap();
    let parameters = ServoParameters::from_store(&store).unwrap();
    let hulls = hulls(away);
    let hulls: Vec<_> = hulls.iter().map(String::as_str).collect();
    let seen = scene(&parameters.arms, &hulls);
    let parameters = parameters.with(|settings| settings.scene = seen);
    let (mut servo, period) = (parameters.build().unwrap(), parameters.period);
    let mut positions = [0.0, 0.4, -0.8, 0.0, 0.6, 0.0];
    servo.set_goal(Isometry3::translation(0.5, 0.3, 0.1));
    let mut most = 0;
    for cycle in 1..400 {
        let before = MEASURED.get();
        let measured = Measured { positions: &positions, velocities: &[0.0; 6] };
        let speeds = servo.cycle(cycle * period, &measured).unwrap().map(<[f64]>::to_vec).unwrap_or_default();
        if cycle > 1 {
            most = most.max(MEASURED.get() - before);
        }
        positions.iter_mut().zip(speeds).for_each(|(angle, speed)| *angle += period.as_secs_f64() * speed);
    }
    assert_ne!(servo.status().state, State::Holding);
    most
}

#[test]
fn what_is_far_is_not_measured_and_what_is_near_not_at_every_place_of_a_stop() {
    assert_eq!(most_measured(3.0), 0);
    let near = most_measured(0.75);
    // There are 360 pairs of a hull and a capsule and 40 positions of a stop. Bounding balls separate most pairs.
    assert!((1..=120).contains(&near), "{near}");
}
