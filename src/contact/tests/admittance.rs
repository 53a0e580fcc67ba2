//! Tests that the offset is exact along one axis, solves its equation on SE(3), and is passive, stable and continuous.

use super::defaults;
use crate::admittance::inverse_jacobian;
use crate::{Admittance, Compliance};
use dq_algebra::{UnitDualQuaternion, stack};
use nalgebra::{Matrix3, Matrix4, Unit, UnitQuaternion, Vector3, Vector6};
use proptest::prelude::*;

/// The delay of most tests \[s\]. Without a delay, the admittance does not raise the damping, so the damping is that of the parameters.
const NO_DELAY: f64 = 0.0;

/// Returns an admittance whose parameters have reached those of `compliance`.
fn settled(compliance: &Compliance) -> Admittance {
    let mut admittance = Admittance::default();
    (0..2000).for_each(|_| admittance.advance(Some(compliance), &Vector6::zeros(), NO_DELAY, 0.1));
    admittance
}

fn compliance(stiffness: f64, damping: f64, mass: f64) -> Compliance {
    Compliance {
        stiffness: [stiffness; 6],
        damping: [damping; 6],
        mass: [mass; 6],
        stiffest: [0.0; 2],
        largest_offset: [2.5; 2],
        ..defaults()
    }
}

/// Returns `y` after the time `t`, for `m y″ + d y′ + k y = f` from rest. Computes it from the roots of the characteristic
/// equation.
fn response([m, d, k]: [f64; 3], f: f64, t: f64) -> f64 {
    let root = (d * d - 4.0 * k * m).sqrt();
    let (one, other) = ((-d + root) / (2.0 * m), (-d - root) / (2.0 * m));
    f / k * (1.0 + (other * (one * t).exp() - one * (other * t).exp()) / (one - other))
}

#[test]
fn a_force_step_gives_the_response_of_the_linear_equation_along_each_axis_at_any_step() {
    for numbers @ [m, d, k] in [[5.0, 300.0, 500.0], [0.1, 20.0, 900.0], [50.0, 1e4, 1.0]] {
        for axis in 0..6 {
            for dt in [0.001, 0.008, 0.05] {
                let compliance = compliance(k, d, m);
                let mut admittance = settled(&compliance);
                let force = if axis < 3 { 0.4 * k } else { 0.02 * k };
                let wrench = Vector6::ith(axis, force);
                for step in 1..=40 {
                    admittance.advance(Some(&compliance), &wrench, NO_DELAY, dt);
                    let y = pair(admittance.offset())[axis];
                    let expected = response(numbers, force, f64::from(step) * dt);
                    assert!(
                        (y - expected).abs() < 1e-6 * force / k,
                        "{numbers:?} {axis} {dt}: {y} {expected}"
                    );
                }
            }
        }
    }
}

/// Returns the matrix of a pose, for an integration that does not use quaternions.
fn matrix(pose: &UnitDualQuaternion) -> Matrix4<f64> {
    pose.frame().to_homogeneous()
}

fn hat(twist: &Vector6<f64>) -> Matrix4<f64> {
    let mut matrix = Matrix4::zeros();
    let turn = twist.fixed_rows::<3>(0).into_owned().cross_matrix();
    matrix.fixed_view_mut::<3, 3>(0, 0).copy_from(&turn);
    matrix.fixed_view_mut::<3, 1>(0, 3).copy_from(&twist.fixed_rows::<3>(3));
    matrix
}

/// Returns the rotation vector and the translation of a pose.
fn pair(pose: &UnitDualQuaternion) -> Vector6<f64> {
    2.0 * pose.half_log()
}

/// Returns the elastic energy of a pose.
fn energy(pose: &UnitDualQuaternion, stiffness: &Vector6<f64>) -> f64 {
    let log = pair(pose);
    0.5 * log.dot(&stiffness.component_mul(&log))
}

fn with(stiffness: [f64; 6], damping: [f64; 6]) -> Compliance {
    Compliance { stiffness, damping, ..compliance(0.0, 1.0, 1.0) }
}

/// Integrates the equation of motion with matrices in steps of 20 µs. The elastic wrench is the gradient of the energy, computed by
/// finite differences.
fn integrated(wrench: &Vector6<f64>, stiffness: &Vector6<f64>, damping: f64, time: f64) -> Matrix4<f64> {
    let (dt, mut pose, mut twist) = (2e-5, Matrix4::<f64>::identity(), Vector6::zeros());
    let energy_at = |pose: &Matrix4<f64>| {
        let rotation = UnitQuaternion::from_matrix(&pose.fixed_view::<3, 3>(0, 0).into_owned());
        energy(
            &UnitDualQuaternion::from_parts(rotation, pose.fixed_view::<3, 1>(0, 3).into_owned()),
            stiffness,
        )
    };
    for _ in 0..(time / dt).round() as usize {
        let gradient = Vector6::from_fn(|i, _| {
            let moved = |by: f64| energy_at(&(pose * hat(&Vector6::ith(i, by)).exp()));
            (moved(1e-4) - moved(-1e-4)) / 2e-4
        });
        twist += dt * (wrench - gradient - damping * twist);
        pose *= hat(&(dt * twist)).exp();
    }
    pose
}

#[test]
fn a_turn_of_two_radians_about_a_skew_axis_agrees_with_an_integration_on_se3() {
    let axis = Unit::new_normalize(Vector3::new(1.0, -2.0, 0.5));
    let wrench = stack(75.0 * axis.into_inner(), Vector3::new(2.0, 1.0, -3.0));
    let six = [40.0, 60.0, 50.0, 30.0, 36.0, 33.0];
    let stiffness = Vector6::new(30.0, 36.0, 33.0, 40.0, 60.0, 50.0);
    let compliance = with(six, [20.0; 6]);
    let mut admittance = settled(&compliance);
    for _ in 0..800 {
        admittance.advance(Some(&compliance), &wrench, NO_DELAY, 0.001);
    }
    let angle = admittance.offset().rotation().angle();
    assert!((1.5..2.4).contains(&angle), "{angle}");
    let difference = matrix(admittance.offset()) - integrated(&wrench, &stiffness, 20.0, 0.8);
    assert!(difference.amax() < 3e-3, "{difference}");
}

#[test]
fn the_inverse_jacobian_turns_the_body_rate_into_the_rate_of_the_rotation_vector() {
    for turn in [[0.0; 3], [1e-8, 0.0, 2e-8], [0.005, -0.006, 0.002], [0.5, -0.6, 0.2], [1.2, -1.0, 1.4]]
        .map(Vector3::from)
    {
        let pose = UnitQuaternion::from_scaled_axis(turn);
        let by_differences = Matrix3::from_fn(|row, column| {
            let moved = |by: f64| {
                (pose * UnitQuaternion::from_scaled_axis(Vector3::ith(column, by))).scaled_axis()[row]
            };
            (moved(1e-5) - moved(-1e-5)) / 2e-5
        });
        let difference = inverse_jacobian(&turn) - by_differences;
        assert!(difference.amax() < 1e-9, "{turn:?}: {difference}");
    }
}

/// Yields `10^p` for a random power `p` in `range`.
fn magnitude(range: std::ops::Range<f64>) -> impl Strategy<Value = f64> {
    range.prop_map(|power| 10_f64.powf(power))
}

proptest! {
    /// Over any motion that begins and ends at rest in the same place, the offset takes in at least as much work as it returns.
    #[test]
    fn the_offset_returns_no_more_work_than_it_took_in(
        stiffness in prop::array::uniform6(magnitude(0.0..3.0)),
        damping in prop::array::uniform6(magnitude(0.0..2.0)),
        pushes in prop::collection::vec(prop::array::uniform6(-20.0..20.0_f64), 1..6),
    ) {
        let compliance = with(stiffness, damping);
        let mut admittance = settled(&compliance);
        let (dt, mut work) = (1e-3, 0.0);
        let rest = std::iter::repeat_n([0.0; 6], 20);
        for push in pushes.into_iter().chain(rest) {
            let wrench = Vector6::from(push);
            for _ in 0..200 {
                let before = *admittance.offset();
                admittance.advance(Some(&compliance), &wrench, NO_DELAY, dt);
                work += wrench.dot(&(before.inverse() * *admittance.offset()).screw_log());
            }
        }
        prop_assert!(work > -1e-2, "the offset gave {} J", -work);
    }

    /// For all parameters, steps, delays and wrenches, also if they change in each step, the offset stays finite and within its limits.
    #[test]
    fn the_offset_stays_within_its_limits_whatever_the_parameters_are(
        steps in prop::collection::vec((
            prop::array::uniform6(prop_oneof![Just(0.0), Just(f64::INFINITY), magnitude(-3.0..9.0)]),
            prop::array::uniform6(magnitude(-3.0..6.0)),
            prop::array::uniform6(magnitude(-3.0..3.0)),
            prop::array::uniform6(prop_oneof![-1e12..1e12_f64, -10.0..10.0_f64]),
            (magnitude(-4.0..0.0), 0.0..0.5_f64),
        ), 1..40),
    ) {
        let mut admittance = Admittance::default();
        for (stiffness, damping, mass, wrench, (dt, delay)) in steps {
            let compliance = Compliance { stiffness, damping, mass, largest_offset: [0.2, 1.0], ..defaults() };
            admittance.advance(Some(&compliance), &Vector6::from(wrench), delay, dt);
            let [distance, angle] = admittance.offset().distances(&UnitDualQuaternion::identity());
            prop_assert!(distance <= 0.2 + 1e-9 && angle <= 1.0 + 1e-9, "{distance} {angle}");
            prop_assert!(admittance.twist().iter().all(|speed| speed.is_finite()));
        }
    }
}

#[test]
fn a_free_direction_moves_as_long_as_it_is_pushed_and_a_stiff_one_does_not_move() {
    let compliance = Compliance {
        stiffness: [0.0, f64::INFINITY, 500.0, 30.0, 30.0, 30.0],
        ..compliance(0.0, 100.0, 5.0)
    };
    let mut admittance = settled(&compliance);
    let push = Vector6::new(0.0, 0.0, 0.0, 10.0, 10.0, 10.0);
    let mut advance = |time: f64| {
        (0..(time / 0.002) as usize)
            .for_each(|_| admittance.advance(Some(&compliance), &push, NO_DELAY, 0.002));
        admittance.offset().translation()
    };
    let (early, late) = (advance(5.0), advance(5.0));
    let speed = (late.x - early.x) / 5.0;
    assert!((speed - 0.1).abs() < 1e-6, "10 N at 100 N s/m: {speed}");
    assert!(late.y.abs() < 1e-7 && (late.z - 0.02).abs() < 1e-6, "{late:?}");
}

#[test]
fn changed_parameters_do_not_move_the_offset_at_once() {
    let (soft, push) = (compliance(500.0, 300.0, 5.0), Vector6::new(0.0, 0.0, 0.0, 0.0, 20.0, 0.0));
    let variants: [(&str, Option<Compliance>); 5] = [
        ("stiffer", Some(Compliance { stiffness: [f64::INFINITY; 6], ..soft })),
        ("free", Some(Compliance { stiffness: [0.0; 6], ..soft })),
        ("heavier", Some(Compliance { mass: [500.0; 6], damping: [1.0; 6], ..soft })),
        ("a smaller limit", Some(Compliance { largest_offset: [0.01, 0.01], ..soft })),
        ("off", None),
    ];
    for (name, changed) in variants {
        let mut admittance = settled(&soft);
        (0..2000).for_each(|_| admittance.advance(Some(&soft), &push, NO_DELAY, 0.002));
        let (mut before, mut fastest) = (admittance.offset().translation().y, 0.0_f64);
        assert!((before - 0.04).abs() < 1e-4);
        for _ in 0..2500 {
            admittance.advance(changed.as_ref(), &push, NO_DELAY, 0.002);
            let y = admittance.offset().translation().y;
            fastest = fastest.max((y - before).abs());
            before = y;
        }
        // 20 N at 300 N s/m are 0.067 m/s. A jump of the offset would be 20 mm or more in one step.
        assert!(fastest < 4e-4, "{name}: {fastest} m in one step");
        let ends =
            if changed.is_some_and(|it| it.stiffness[0] == 0.0) { before > 0.3 } else { before < 0.045 };
        assert!(ends, "{name}: {before}");
        if changed.is_none() {
            assert_eq!(admittance, Admittance::default(), "the offset has ended");
        }
    }
}

/// Simulates for 6 s a goal that moves along x at 5 cm/s into a wall with the stiffness `wall` \[N/m\]. The wall's force reaches the
/// admittance `delay` \[s\] late, but the admittance assumes the delay `told` \[s\]. Returns the largest deviation of the force from its
/// mean in the last second, divided by this mean.
fn swings(wall: f64, delay: f64, compliance: &Compliance, told: f64) -> f64 {
    let dt = 1e-3;
    let mut admittance = settled(compliance);
    let mut past = vec![0.0; (delay / dt) as usize + 1];
    let (mut forces, mut goal) = (Vec::new(), -0.01_f64);
    for step in 0..6000 {
        goal = (goal + 5e-5).min(0.02);
        let tool = goal + admittance.offset().translation().x;
        past.push(-wall * tool.max(0.0));
        let felt = past[past.len() - 1 - (delay / dt) as usize];
        // The tool is to press with 5 N.
        admittance.advance(Some(compliance), &Vector6::new(0.0, 0.0, 0.0, felt + 5.0, 0.0, 0.0), told, dt);
        if step > 5000 {
            forces.push(-felt);
        }
    }
    let mean = forces.iter().sum::<f64>() / forces.len() as f64;
    forces.iter().map(|force| (force - mean).abs()).fold(0.0, f64::max) / mean
}

/// Returns the theoretical damping `d` at the border of stability. The contact has the stiffness `k`, and the delay is `t`. The
/// admittance has the mass `m` and the stiffness `stiffness`, which is `K` in the formulas. At the border, `d = k sin(ω t)/ω`, and
/// the angular frequency `ω` solves `m ω² = K + k cos(ω t)`.
fn border(k: f64, t: f64, [m, stiffness]: [f64; 2]) -> f64 {
    let (mut low, mut high) = (0.0, std::f64::consts::PI / t);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        let rises = m * middle * middle - stiffness - k * (middle * t).cos() > 0.0;
        (low, high) = if rises { (low, middle) } else { (middle, high) };
    }
    k * (low * t).sin() / low
}

#[test]
fn the_border_of_stability_is_where_theory_has_it_and_the_least_damping_lies_beyond_it() {
    for (wall, delay) in [(1e3, 0.05), (1e4, 0.02), (1e5, 0.008), (1e5, 0.05)] {
        let base = Compliance { cutoff: 1e3, ..compliance(0.0, 1.0, 2.0) };
        let critical = border(wall, delay, [2.0, 0.0]);
        let damped = |factor: f64| Compliance { damping: [factor * critical; 6], ..base };
        // One step of the simulation adds to the delay, so the border is a little lower than without steps.
        let (within, beyond) =
            (swings(wall, delay, &damped(0.8), 0.0), swings(wall, delay, &damped(1.3), 0.0));
        assert!(within > 0.5, "unstable below the border: {wall} {delay} {within}");
        assert!(beyond < 0.1, "stable above it: {wall} {delay} {beyond}");
        let told = Compliance { stiffest: [wall, 100.0], ..base };
        let chosen = swings(wall, delay, &told, delay);
        assert!(chosen < 0.02, "the least damping is stable: {wall} {delay} {chosen}");
    }
}
