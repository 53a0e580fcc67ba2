//! The rules of the algebra, on a grid and for random poses.

mod reference;
mod tolerance;

use dq_algebra::*;
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3, Vector6};
use proptest::prelude::*;
use reference::{distance, json, numbers};
use std::f64::consts::PI;
use tolerance::{ALGEBRA, REFERENCE};

/// Tolerance for logarithms of poses with a rotation near π. There the translation multiplies the rounding error of the angle.
const LOG: f64 = 1e-11;

fn assert_close(a: &[f64], b: &[f64], tolerance: f64) {
    assert!(distance(a, b) <= tolerance, "{a:?}\nis not\n{b:?}");
}

/// Returns twists with angles from zero to just past a half turn, including pure translations.
fn twists() -> Vec<Vector6<f64>> {
    let axes = [Vector3::z(), Vector3::new(0.6, 0.0, -0.8), Vector3::new(1.0, -2.0, 2.0) / 3.0];
    let angles =
        [0.0, 1e-12, 1e-8, 1e-4, 0.009, 0.011, 0.5, 2.0, PI - 1e-8, PI - 1e-12, PI, PI + 1e-8, PI + 0.3];
    let linears = [Vector3::zeros(), Vector3::new(0.3, -1.2, 2.0), Vector3::z()];
    let mut all = Vec::new();
    for (axis, angle) in axes.iter().flat_map(|axis| angles.map(|angle| (axis, angle))) {
        for linear in linears {
            let omega = axis * angle;
            all.push(Vector6::new(omega.x, omega.y, omega.z, linear.x, linear.y, linear.z));
        }
    }
    all
}

fn is_unit(q: &UnitDualQuaternion) -> bool {
    (q.real().norm() - 1.0).abs() < ALGEBRA && q.real().dot(&q.dual()).abs() < ALGEBRA
}

fn any_twist() -> impl Strategy<Value = Vector6<f64>> {
    prop::array::uniform6(-1.7..1.7f64).prop_map(Vector6::from)
}

/// Returns eight arbitrary numbers, which are usually not a pose.
fn any_numbers() -> impl Strategy<Value = DualQuaternion> {
    prop::array::uniform8(-2.0..2.0f64)
        .prop_map(|numbers| DualQuaternion::from_vector8(&Vector8::from(numbers)))
}

fn any_pose() -> impl Strategy<Value = UnitDualQuaternion> {
    any_twist().prop_map(|twist| UnitDualQuaternion::screw_exp(&twist))
}

#[test]
fn logarithms_invert_exponentials_from_zero_past_a_half_turn() {
    for twist in twists() {
        let pose = UnitDualQuaternion::screw_exp(&twist);
        assert!(is_unit(&pose));
        assert_close(pose.screw_log().as_slice(), twist.as_slice(), LOG);
        let half = UnitDualQuaternion::half_exp(&(0.5 * twist));
        assert!(is_unit(&half));
        assert_close(half.half_log().as_slice(), (0.5 * twist).as_slice(), LOG);
    }
}

#[test]
fn the_screw_log_agrees_with_the_matrix_exponential() {
    for twist in twists() {
        let mut generator = nalgebra::Matrix4::zeros();
        let omega: Vector3<f64> = twist.fixed_rows::<3>(0).into();
        generator.fixed_view_mut::<3, 3>(0, 0).copy_from(&omega.cross_matrix());
        generator.fixed_view_mut::<3, 1>(0, 3).copy_from(&twist.fixed_rows::<3>(3));
        let matrix = UnitDualQuaternion::screw_exp(&twist).frame().to_homogeneous();
        assert_close(matrix.as_slice(), generator.exp().as_slice(), LOG);
    }
}

#[test]
fn small_logarithms_keep_their_relative_precision() {
    let twist = Vector6::new(1e-12, -2e-12, 3e-12, 4e-12, 5e-12, -6e-12);
    let log = UnitDualQuaternion::screw_exp(&twist).screw_log();
    assert_close((log / 1e-12).as_slice(), (twist / 1e-12).as_slice(), 1e-3);
    assert_close(log.as_slice(), twist.as_slice(), 1e-24);
}

#[test]
fn towards_a_full_turn_the_log_loses_digits_of_its_linear_part_alone() {
    let (axis, linear) = (Vector3::new(0.48, -0.6, 0.64), Vector3::new(0.3, -0.2, 0.5));
    for short in [1.0, 1e-2, 1e-4, 1e-6, 1e-8] {
        let omega = (2.0 * std::f64::consts::PI - short) * axis;
        let twist = Vector6::new(omega.x, omega.y, omega.z, linear.x, linear.y, linear.z);
        let error = UnitDualQuaternion::screw_exp(&twist).screw_log() - twist;
        assert!(error.fixed_rows::<3>(0).norm() < LOG, "{short}: {error}");
        let lost = error.fixed_rows::<3>(3).norm();
        assert!(lost < 1e-14 + 5e-15 / short && (short > 1e-8 || lost > 1e-9), "{short}: {lost:e}");
    }
}

#[test]
fn at_a_full_turn_the_log_is_finite() {
    let log = (-UnitDualQuaternion::from_parts(UnitQuaternion::identity(), Vector3::x())).screw_log();
    assert!(log.iter().all(|x| x.is_finite()));
}

#[test]
fn products_of_any_number_stay_unit() {
    let step = UnitDualQuaternion::screw_exp(&Vector6::new(0.3, -0.2, 0.7, 0.1, 0.2, -0.1));
    let product = (0..100_000).fold(UnitDualQuaternion::identity(), |product, _| product * step);
    assert!(is_unit(&product));
}

#[test]
fn vectors_become_dual_quaternions_and_back() {
    let eight = Vector8::from([1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0]);
    assert_eq!(DualQuaternion::from_vector8(&eight).to_vector8(), eight);
    let six = DualQuaternion::from_vector6(&Vector6::new(1.0, 2.0, 3.0, 4.0, 5.0, 6.0));
    assert_eq!(six.to_vector8().as_slice(), [0.0, 1.0, 2.0, 3.0, 0.0, 4.0, 5.0, 6.0]);
}

#[test]
fn normalising_gives_the_nearest_pose_or_says_why_not() {
    let pose = UnitDualQuaternion::screw_exp(&Vector6::new(0.3, -0.2, 0.7, 0.1, 0.2, -0.1));
    let off = DualQuaternion { real: pose.real() * 2.0, dual: pose.dual() * 2.0 + pose.real() * 0.1 };
    let back = UnitDualQuaternion::try_normalize(&off).unwrap();
    assert_close(back.to_vector8().as_slice(), pose.to_vector8().as_slice(), ALGEBRA);
    let zero = DualQuaternion::from_vector8(&Vector8::zeros());
    assert_eq!(UnitDualQuaternion::try_normalize(&zero), Err(DqError::ZeroRealPart));
    let mut nan = Vector8::zeros();
    nan[5] = f64::INFINITY;
    let nan = UnitDualQuaternion::try_normalize(&DualQuaternion::from_vector8(&nan));
    assert_eq!(nan, Err(DqError::NonFinite(f64::INFINITY)));
}

/// Checks real parts whose squares or inverses are not representable.
#[test]
fn normalising_takes_real_parts_of_any_size() {
    let pose = UnitDualQuaternion::screw_exp(&Vector6::new(0.3, -0.2, 0.7, 0.1, 0.2, -0.1));
    // Subnormal numbers have few digits.
    for (size, tolerance) in
        [(1e300, ALGEBRA), (1e155, ALGEBRA), (1e-162, ALGEBRA), (1e-200, ALGEBRA), (1e-310, 1e-12)]
    {
        let off = DualQuaternion { real: pose.real() * size, dual: pose.dual() * size };
        let back = UnitDualQuaternion::try_normalize(&off).unwrap();
        assert_close(back.to_vector8().as_slice(), pose.to_vector8().as_slice(), tolerance);
    }
    let smallest =
        DualQuaternion { real: Quaternion::new(0.0, 5e-324, 0.0, 0.0), dual: Quaternion::identity() * 0.0 };
    let turned = UnitDualQuaternion::try_normalize(&smallest).unwrap();
    assert_eq!(turned.real(), Quaternion::new(0.0, 1.0, 0.0, 0.0));
    for dual in [Quaternion::new(0.0, 1e300, 0.0, 0.0), Quaternion::new(1e300, 1e300, 0.0, 0.0)] {
        let far = DualQuaternion { real: Quaternion::new(1e-10, 0.0, 0.0, 0.0), dual };
        let error = UnitDualQuaternion::try_normalize(&far);
        assert!(matches!(error, Err(DqError::NonFinite(_))), "{error:?}");
    }
}

#[test]
fn angle_axis_inverts_and_keeps_the_sign() {
    let axis = nalgebra::Unit::new_normalize(Vector3::new(1.0, 2.0, -2.0));
    for angle in [1e-9, 1.0, PI, 5.0] {
        let (back, about) = angle_axis(&quaternion_from_angle_axis(angle, &axis));
        assert!((back - angle).abs() < ALGEBRA && (about.into_inner() - axis.into_inner()).norm() < LOG);
    }
    assert_eq!(angle_axis(&UnitQuaternion::identity()).0, 0.0);
}

#[test]
fn printed_logarithms_of_the_paper_are_met() {
    let printed = &json()["printed"];
    for (pose, log) in [("relative_q", "half_log_relative_paper"), ("q_initial", "half_log_initial_paper")] {
        let q = DualQuaternion::from_vector8(&Vector8::from_vec(numbers(&printed[pose])));
        let half_log = UnitDualQuaternion::try_normalize(&q).unwrap().half_log();
        assert_close(&half_log.as_slice()[..3], &numbers(&printed[log]["half_rotation_vector"]), REFERENCE);
        assert_close(&half_log.as_slice()[3..], &numbers(&printed[log]["half_translation"]), REFERENCE);
    }
    let q = DualQuaternion::from_vector8(&Vector8::from_vec(numbers(&printed["relative_q"])));
    let twist = UnitDualQuaternion::try_normalize(&q).unwrap().screw_log();
    let computed = &json()["computed"]["screw_log_relative"];
    assert_close(&twist.as_slice()[..3], &numbers(&computed["rotation_vector"]), REFERENCE);
    assert_close(&twist.as_slice()[3..], &numbers(&computed["screw_translation"]), REFERENCE);
}

#[test]
fn poses_come_from_and_go_to_nalgebra() {
    let rotation = UnitQuaternion::from_euler_angles(0.3, -0.2, 1.4);
    let frame = Isometry3::from_parts(Translation3::new(0.1, 0.2, 0.3), rotation);
    let back = Isometry3::from(UnitDualQuaternion::from(frame));
    assert!((back.to_homogeneous() - frame.to_homogeneous()).norm() < 1e-15);
    let turned = UnitDualQuaternion::from(rotation);
    assert_eq!((turned.rotation(), turned.translation()), (rotation, Vector3::zeros()));
}

/// Checks screws of many angles from each start pose. The end pose has either sign of its quaternion.
#[test]
fn sclerp_follows_the_shorter_screw() {
    let starts = [Vector6::zeros(), Vector6::new(0.3, -0.2, 0.7, 0.1, 0.2, -0.1)]
        .map(|log| UnitDualQuaternion::screw_exp(&log));
    for (twist, start) in twists().into_iter().flat_map(|twist| starts.map(|start| (twist, start))) {
        let angle = twist.fixed_rows::<3>(0).norm();
        let end = start * UnitDualQuaternion::screw_exp(&twist);
        // At a half turn, rounding decides which screw is shorter.
        if (angle - PI).abs() < 1e-9 {
            continue;
        }
        let shorter = if angle < PI { twist } else { (-UnitDualQuaternion::screw_exp(&twist)).screw_log() };
        assert!(shorter.fixed_rows::<3>(0).norm() < PI);
        for t in [0.0, 0.25, 0.5, 1.0, 1.5] {
            let expected = start * UnitDualQuaternion::screw_exp(&(t * shorter));
            for end in [end, -end] {
                let pose = start.sclerp(&end, t);
                assert!(is_unit(&pose));
                assert_close(pose.to_vector8().as_slice(), expected.to_vector8().as_slice(), LOG);
            }
        }
    }
}

#[test]
fn at_a_half_turn_sclerp_ends_at_the_other_pose() {
    let start = UnitDualQuaternion::screw_exp(&Vector6::new(0.3, -0.2, 0.7, 0.1, 0.2, -0.1));
    for angle in [PI - 1e-12, PI, PI + 1e-12] {
        let end = start * UnitDualQuaternion::screw_exp(&Vector6::new(0.0, 0.0, angle, 0.3, 0.2, 1.0));
        let [distance, turn] = start.sclerp(&end, 1.0).distances(&end);
        assert!(distance < LOG && turn < 1e-7, "{distance} {turn}");
        assert!((start.sclerp(&end, 0.5).distances(&start)[1] - 0.5 * PI).abs() < 1e-7);
    }
}

/// Checks that nalgebra's `UnitDualQuaternion` has the shortcomings that the README names. They are the reasons why this crate has
/// another type.
#[test]
fn nalgebra_lacks_what_the_readme_says() {
    use nalgebra::UnitDualQuaternion as Theirs;
    let off = nalgebra::DualQuaternion::from_real_and_dual(
        Quaternion::new(1.0, 0.0, 0.0, 0.0),
        Quaternion::new(1.0, 0.0, 0.0, 0.0),
    );
    let normalized = Theirs::new_normalize(off).into_inner();
    assert_eq!(normalized.real.dot(&normalized.dual), 1.0);

    let turned = |angle| Isometry3::rotation(Vector3::z() * angle);
    let theirs =
        |angle| Theirs::identity().try_sclerp(&Theirs::from_isometry(&turned(angle)), 1.0, f64::EPSILON);
    assert_eq!(theirs(2e-8).unwrap().rotation().angle(), 0.0);
    assert!(theirs(PI).is_none());
    let ours = UnitDualQuaternion::identity().sclerp(&turned(2e-8).into(), 1.0);
    assert!((ours.rotation().angle() - 2e-8).abs() < 1e-22);

    let step = UnitDualQuaternion::screw_exp(&Vector6::new(0.3, -0.2, 0.7, 0.1, 0.2, -0.1));
    let step = Theirs::from_isometry(&step.frame());
    let product = (0..100_000).fold(Theirs::identity(), |product, _| product * step).into_inner();
    let off = product.real.norm() - 1.0;
    assert!(off.abs() > 1e-13, "{off:e} {:e}", product.real.dot(&product.dual));
}

#[test]
fn numbers_are_displayed_with_their_units_and_precision() {
    let pose = UnitDualQuaternion::from_parts(UnitQuaternion::identity(), Vector3::new(0.25, -2.0, 3.0));
    assert_eq!(pose.to_string(), "1 + 0i + 0j + 0k + ε(-0 + 0.125i - 1j + 1.5k)");
    assert_eq!(format!("{pose:.2}"), "1.00 + 0.00i + 0.00j + 0.00k + ε(-0.00 + 0.12i - 1.00j + 1.50k)");
}

#[cfg(feature = "serde")]
#[test]
fn poses_are_serialized_as_eight_numbers() {
    let pose = UnitDualQuaternion::screw_exp(&Vector6::new(0.3, -0.2, 0.7, 0.1, 0.2, -0.1));
    let text = serde_json::to_string(&pose).unwrap();
    assert_eq!(serde_json::from_str::<Vec<f64>>(&text).unwrap(), pose.to_vector8().as_slice());
    assert_eq!(serde_json::from_str::<UnitDualQuaternion>(&text).unwrap(), pose);
    assert!(serde_json::from_str::<UnitDualQuaternion>("[0, 0, 0, 0, 0, 0, 0, 0]").is_err());
}

proptest! {
    #[test]
    fn products_are_associative_and_unit((a, b, c) in (any_pose(), any_pose(), any_pose())) {
        let (left, right) = ((a * b) * c, a * (b * c));
        prop_assert!(is_unit(&left));
        prop_assert!((left.to_vector8() - right.to_vector8()).norm() < ALGEBRA * 10.0);
    }

    #[test]
    fn products_compose_frames((a, b) in (any_pose(), any_pose())) {
        let expected = a.frame() * b.frame();
        let got = (a * b).frame();
        prop_assert!((got.translation.vector - expected.translation.vector).norm() < ALGEBRA * 10.0);
        prop_assert!(got.rotation.angle_to(&expected.rotation) < 1e-7);
        let point = nalgebra::Point3::new(0.3, -1.2, 2.0);
        prop_assert!(((a * b).transform_point(&point) - expected * point).norm() < ALGEBRA * 100.0);
        let mut product = a;
        product *= b;
        prop_assert_eq!(product, a * b);
        let mut product = *a.as_dual_quaternion();
        product *= *b.as_dual_quaternion();
        prop_assert_eq!(product, *a.as_dual_quaternion() * *b.as_dual_quaternion());
    }

    #[test]
    fn sclerp_agrees_with_nalgebra((a, b) in (any_pose(), any_pose()), t in 0.0..1.0f64) {
        let theirs = |q: &UnitDualQuaternion| nalgebra::UnitDualQuaternion::from_isometry(&q.frame());
        // At a half turn nalgebra has no result; near a half turn, its result has fewer digits.
        prop_assume!(a.real().dot(&b.real()).abs() > 1e-3);
        let expected = theirs(&a).try_sclerp(&theirs(&b), t, 0.0).unwrap().to_isometry();
        let [distance, turn] = a.sclerp(&b, t).distances(&expected.into());
        prop_assert!(distance < 1e-9 && turn < 1e-7, "{distance} {turn}");
    }

    #[test]
    fn the_conjugate_is_the_inverse(a in any_pose()) {
        let identity = UnitDualQuaternion::identity().to_vector8();
        prop_assert_eq!(*a.inverse().as_dual_quaternion(), a.as_dual_quaternion().conjugate());
        prop_assert!(((a * a.inverse()).to_vector8() - identity).norm() < ALGEBRA);
        prop_assert_eq!((-a).frame().translation.vector, a.frame().translation.vector);
    }

    #[test]
    fn the_adjoint_moves_twists_to_the_base((a, twist) in (any_pose(), any_twist())) {
        // exp(Ad ξ) = q exp(ξ) q*
        let moved = UnitDualQuaternion::screw_exp(&(a.adjoint() * twist));
        let conjugated = a * UnitDualQuaternion::screw_exp(&twist) * a.inverse();
        prop_assert!((moved.to_vector8() - conjugated.to_vector8()).norm() < LOG);
    }

    /// Checks the paper's `Hp`, `Hn`, `dHp` and `dHn` for arbitrary numbers (eq. 9–11).
    #[test]
    fn hamilton_operators_of_any_numbers_are_products((p, q) in (any_numbers(), any_numbers())) {
        let product = (p * q).to_vector8();
        prop_assert!((dual_hamilton_plus(&p) * q.to_vector8() - product).norm() < ALGEBRA * 10.0);
        prop_assert!((dual_hamilton_minus(&q) * p.to_vector8() - product).norm() < ALGEBRA * 10.0);
        let (a, b) = (hamilton_plus(&p.real), hamilton_minus(&q.real));
        // H⁺ and H⁻ commute, as (p x) q = p (x q).
        prop_assert!((a * b - b * a).norm() < ALGEBRA * 10.0);
    }

    /// Checks the paper's `cdualq`: the conjugate of a product is the product of the conjugates in reverse order.
    #[test]
    fn conjugates_turn_products_round((p, q) in (any_numbers(), any_numbers())) {
        let (left, right) = ((p * q).conjugate(), q.conjugate() * p.conjugate());
        prop_assert!((left.to_vector8() - right.to_vector8()).norm() < ALGEBRA * 10.0);
    }

    /// Checks the paper's `logdq` and `explogdq` (eq. 32), and the logarithm and the exponential of SE(3). The two functions of
    /// each pair are inverse to each other.
    #[test]
    fn logarithms_of_any_pose_lead_back_to_it(pose in any_pose()) {
        for back in [
            UnitDualQuaternion::half_exp(&pose.half_log()),
            UnitDualQuaternion::screw_exp(&pose.screw_log()),
        ] {
            prop_assert!((back.to_vector8() - pose.to_vector8()).norm() < LOG);
        }
        // The inverse is the reversed screw.
        prop_assert!((pose.inverse().screw_log() + pose.screw_log()).norm() < LOG);
    }

    /// Checks that half of the logarithm leads to the middle of the screw.
    #[test]
    fn two_halves_of_a_screw_are_the_whole(twist in any_twist()) {
        let half = UnitDualQuaternion::screw_exp(&(0.5 * twist));
        let whole = UnitDualQuaternion::screw_exp(&twist);
        prop_assert!(((half * half).to_vector8() - whole.to_vector8()).norm() < ALGEBRA * 10.0);
    }

    #[test]
    fn adjoints_of_products_are_products_of_adjoints((a, b) in (any_pose(), any_pose())) {
        prop_assert!(((a * b).adjoint() - a.adjoint() * b.adjoint()).norm() < ALGEBRA * 100.0);
    }

    #[test]
    fn nalgebra_agrees_on_products((a, b) in (any_pose(), any_pose())) {
        let theirs = |q: &UnitDualQuaternion| nalgebra::DualQuaternion::from_real_and_dual(q.real(), q.dual());
        let product = theirs(&a) * theirs(&b);
        prop_assert!((product.real - (a * b).real()).norm() < ALGEBRA);
        prop_assert!((product.dual - (a * b).dual()).norm() < ALGEBRA * 10.0);
    }
}
