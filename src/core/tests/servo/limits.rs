//! Tests of rules 5 and 6 of the guide's safety page: limits on speeds and accelerations.

use crate::rig::Rig;
use dq_core::servo::State;
use dq_kinematics::control::Law;
use nalgebra::Vector3;

#[test]
fn rule_5_speed_limits_scale_the_whole_vector() {
    let run = |limit: f64| {
        let mut rig = Rig::with(|settings| {
            settings.limits.joint_velocity = vec![limit; 6];
            settings.limits.joint_acceleration = vec![1e4; 6];
        });
        rig.goal("theta_desired");
        rig.cycle();
        rig.command
    };
    let (free, limited) = (run(5.0), run(0.2));
    let ratio = limited.iter().zip(&free).map(|(a, b)| a / b).collect::<Vec<_>>();
    assert!(limited.iter().all(|speed| speed.abs() <= 0.2 + 1e-12));
    assert!(ratio.iter().all(|r| (r - ratio[0]).abs() < 0.05 * ratio[0].abs()), "{ratio:?}");
}

#[test]
fn rule_6_a_high_gain_neither_overshoots_nor_shakes_under_the_acceleration_limit() {
    let mut rig = Rig::with(|settings| settings.limits.joint_acceleration = vec![5.0; 6]);
    rig.set_law(Law::Diffc);
    rig.goal("theta_desired");
    rig.run(3.0);
    // The joints do not swing in the slow last part of the motion: each joint keeps its direction.
    let before = rig.command.clone();
    let mut swings = 0;
    let mut last = before;
    for _ in 0..500 {
        rig.cycle();
        swings += last.iter().zip(&rig.command).filter(|(a, b)| **a * **b < 0.0).count();
        last.clone_from(&rig.command);
    }
    assert!(swings <= 6, "{swings} changes of direction in a second");
    rig.run_until(State::Settled, 40.0);
}

/// Returns the path of the tool to `goal` under `law` \[m\]. Joint accelerations are limited to `acceleration` [rad/s²].
fn path(law: Law, goal: &str, acceleration: f64) -> Vec<Vector3<f64>> {
    let mut rig = Rig::with(|settings| {
        settings.limits.joint_acceleration = vec![acceleration; 6];
        settings.limits.joint_deceleration = vec![acceleration; 6];
    });
    rig.set_law(law);
    rig.goal(goal);
    let point = |_| {
        rig.cycle();
        rig.servo.pose().unwrap().translation()
    };
    (0..4000).map(point).collect()
}

/// Returns the largest distance from a point of `path` to `other` \[m\].
fn deviation(path: &[Vector3<f64>], other: &[Vector3<f64>]) -> f64 {
    let to_segment = |point: &Vector3<f64>, pair: &[Vector3<f64>]| {
        let (from, way) = (pair[0], pair[1] - pair[0]);
        let along = ((point - from).dot(&way) / way.norm_squared().max(1e-30)).clamp(0.0, 1.0);
        (point - from - along * way).norm()
    };
    let nearest = |point| other.windows(2).map(|pair| to_segment(point, pair)).fold(f64::INFINITY, f64::min);
    path.iter().step_by(10).map(nearest).fold(0.0, f64::max)
}

#[test]
fn rule_6_the_acceleration_limit_bends_the_path_as_its_documentation_says() {
    let free = path(Law::Logc, "theta_desired", 1e4);
    for (acceleration, expected) in [(50.0, 1e-5), (5.0, 1.3e-3), (2.0, 7e-3)] {
        let bent = deviation(&path(Law::Logc, "theta_desired", acceleration), &free);
        assert!((0.7..1.3).contains(&(bent / expected)), "{acceleration} rad/s^2: {bent} m");
    }
}
