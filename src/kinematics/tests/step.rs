//! The program's control step agrees with the plain control step of `plain.rs`.

use crate::plain::PlainArm;
use crate::puma::{controller, puma};
use crate::tolerance::REFERENCE;
use dq_algebra::UnitDualQuaternion;
use dq_kinematics::arm::{ArmState, Chain, Convention, DhRow};
use dq_kinematics::control::{Aim, Controller, Damping, Law, nearer_goal};
use nalgebra::Vector3;
use proptest::prelude::*;
use std::f64::consts::FRAC_PI_2;

fn puma_rows() -> Vec<DhRow> {
    let row = |i: usize| DhRow {
        alpha: [0.0, -FRAC_PI_2, 0.0, -FRAC_PI_2, FRAC_PI_2, -FRAC_PI_2][i],
        a: [0.0, 0.0, 0.4318, 0.019, 0.0, 0.0][i],
        d: [0.0, 0.0, 0.125, 0.432, 0.0, 0.0][i],
        theta_offset: 0.0,
    };
    (0..6).map(row).collect()
}

/// Returns DH rows of seven joints with offsets. The program computes six columns of the Jacobian at once. With seven joints, a test
/// covers the column that remains too.
pub fn seven_rows() -> Vec<DhRow> {
    let row = |i: usize| DhRow {
        alpha: [1.5, -1.2, 0.3, 0.0, 1.0, -1.5, 0.4][i],
        a: [0.1, 0.3, 0.0, 0.2, 0.05, 0.0, 0.1][i],
        d: [0.3, 0.0, 0.25, 0.0, 0.1, 0.2, 0.05][i],
        theta_offset: [0.0, 0.5, -0.3, 1.0, 0.0, 0.2, -1.0][i],
    };
    (0..7).map(row).collect()
}

/// Allowed difference between the program's joint velocities and those of [`PlainArm`], as a fraction of the largest velocity. Near
/// singularities, the elimination of the angular block loses digits: of 300 000 configurations, three differed by more than 1e-11.
/// Arms with fewer than six joints are singular everywhere. Their damping depends on the eigenvalue 0, which has a rounding error in
/// [`PlainArm`]. If the square of the damping threshold is nearly an eigenvalue of the angular block of `J Jᵀ`, the smallest eigenvalue
/// loses digits: of 1 500 000 random configurations and thresholds, four differed by more than 1e-10, and 300 000 others had one beyond
/// 1e-9.
const NEAR: f64 = 10.0 * REFERENCE;
const NEAR_BESIDE_SINGULARITY: f64 = 1000.0 * REFERENCE;
const NEAR_WITH_ANY_THRESHOLD: f64 = 1e5 * REFERENCE;
const NEAR_SINGULAR_TWICE: f64 = 1e6 * REFERENCE;
const NEAR_WITH_ANY_ARM: f64 = 100.0 * REFERENCE;

/// Checks kinematics, Jacobian, singular value and three laws at the joint positions `theta`. The goal is the pose of the tool at the
/// joint positions `goal`.
fn check(convention: Convention, rows: &[DhRow], theta: &[f64], goal: &[f64]) {
    check_damped(controller().damping, NEAR, convention, rows, theta, goal);
}

/// Makes the checks of `check` with the given damping. `limit` is the allowed difference between the program's joint velocities and
/// those of [`PlainArm`], as a fraction of the largest velocity.
fn check_damped(
    damping: Damping,
    limit: f64,
    convention: Convention,
    rows: &[DhRow],
    theta: &[f64],
    goal: &[f64],
) {
    let chain = Chain::new(convention, rows).unwrap();
    let (mut arm, mut plain) = (ArmState::new(&chain), PlainArm::new(convention, rows));
    plain.evaluate(goal);
    let goal = plain.base_from_tool;
    chain.evaluate(theta, &mut arm).unwrap();
    plain.evaluate(theta);
    // The servo takes the nearer sign. At a whole turn the logarithm has no axis.
    let goal = nearer_goal(&goal, &plain.base_from_tool);
    let near =
        |a: &UnitDualQuaternion, b: &UnitDualQuaternion| (a.to_vector8() - b.to_vector8()).norm() < REFERENCE;
    assert!(near(&arm.base_from_tool(), &plain.base_from_tool));
    assert!(near(&chain.forward_kinematics(theta).unwrap(), &plain.base_from_tool));
    assert!((arm.tool_point() - plain.base_from_tool.translation()).norm() < REFERENCE);
    for (ours, plain) in arm.pose_jacobian().column_iter().zip(plain.pose_columns()) {
        assert!((ours - plain).norm() < REFERENCE);
    }
    let (sigma, expected) = (arm.smallest_singular_value(), plain.smallest_singular_value());
    assert!((sigma * sigma - expected * expected).abs() < REFERENCE, "{sigma} instead of {expected}");
    // For smaller values, rounding decides the comparison of squares.
    if sigma > 1e-4 {
        let below = |part: f64| controller().singular_value_below(part * sigma, &arm);
        assert_eq!([below(0.99), below(1.01), below(f64::INFINITY)], [None, Some(sigma), Some(sigma)]);
    }
    for law in [Law::Diffc, Law::Logc, Law::DoubleGeodesic] {
        let controller = Controller { law, damping, ..controller() };
        let (mut ours, mut expected) = (vec![0.0; theta.len()], vec![0.0; theta.len()]);
        controller.joint_velocity(&arm, &goal, &mut ours);
        let gains = controller.gains(law);
        match law.name() {
            "logc" => plain.logc(gains, &controller.damping, &goal, &mut expected),
            "double_geodesic" => plain.double_geodesic(gains, &controller.damping, &goal, &mut expected),
            _ => plain.diffc(controller.gain(), &goal, &mut expected),
        }
        let largest = expected.iter().fold(1.0_f64, |max, speed| max.max(speed.abs()));
        let limit = limit * largest;
        for (ours, expected) in ours.iter().zip(&expected) {
            assert!((ours - expected).abs() < limit, "{law}: {ours} instead of {expected}");
        }
    }
}

#[test]
fn the_plain_arm_equals_the_built_in_one() {
    assert_eq!(Chain::new(Convention::ModifiedDh, &puma_rows()).unwrap(), puma());
}

#[test]
fn singular_configurations_agree_with_the_plain_step() {
    // The wrist is singular; the wrist and the elbow; two eigenvalues are 0; angles are large.
    for theta in [
        [0.3, 0.5, 0.7, 0.2, 0.0, 0.4],
        [0.3, 0.5, -1.526_844_3, 0.2, 0.0, 0.4],
        [0.0; 6],
        [FRAC_PI_2; 6],
        [1e3, -2e4, 1e5, 7.0, -300.0, 12.0],
    ] {
        check(Convention::ModifiedDh, &puma_rows(), &theta, &[0.1, 0.2, 2.0, 0.4, 0.5, 0.6]);
    }
}

/// Without damping, the matrix `J Jᵀ` of an arm with one joint has no inverse. The joint must still turn with the
/// component of the twist's angular velocity along the joint's axis.
#[test]
fn an_arm_without_an_inverse_moves_where_it_can_without_damping() {
    let row = DhRow { alpha: 0.0, a: 0.0, d: 0.0, theta_offset: 0.0 };
    let chain = Chain::new(Convention::ModifiedDh, &[row]).unwrap();
    let mut arm = ArmState::new(&chain);
    chain.evaluate(&[0.3], &mut arm).unwrap();
    let mut theta_dot = [0.0];
    let twist = (Vector3::new(0.5, 0.0, 0.7), Vector3::new(0.1, 0.2, 0.3));
    Damping { max: 0.0, threshold: 0.05 }.joint_velocity(&arm, Aim::Pose, || twist, &mut theta_dot);
    assert!((theta_dot[0] - 0.7).abs() < 1e-8, "{theta_dot:?}");
}

/// Checks an arm whose link twists are multiples of 90°. Such an arm is often singular in several directions at once. The
/// determinants of its matrices are then zero up to rounding.
fn check_arm_of_right_angles(rows: &[(i8, u8, u8)], theta: &[f64], goal: &[f64]) {
    let row = |(alpha, a, d)| DhRow {
        alpha: f64::from(alpha) * FRAC_PI_2,
        a: 0.3 * f64::from(a),
        d: 0.2 * f64::from(d),
        theta_offset: 0.0,
    };
    let rows: Vec<_> = rows.iter().copied().map(row).collect();
    let (theta, goal) = (&theta[..rows.len()], &goal[..rows.len()]);
    let chain = Chain::new(Convention::StandardDh, &rows).unwrap();
    let (mut arm, mut plain) = (ArmState::new(&chain), PlainArm::new(Convention::StandardDh, &rows));
    chain.evaluate(theta, &mut arm).unwrap();
    plain.evaluate(theta);
    let goal = nearer_goal(&chain.forward_kinematics(goal).unwrap(), &plain.base_from_tool);
    let controller = Controller { law: Law::DoubleGeodesic, ..controller() };
    let (mut ours, mut expected) = (vec![0.0; theta.len()], vec![0.0; theta.len()]);
    controller.joint_velocity(&arm, &goal, &mut ours);
    plain.double_geodesic(controller.gains(controller.law), &controller.damping, &goal, &mut expected);
    let largest = expected.iter().fold(1.0_f64, |max, speed| max.max(speed.abs()));
    for (ours, expected) in ours.iter().zip(&expected) {
        assert!((ours - expected).abs() < NEAR_SINGULAR_TWICE * largest, "{ours} instead of {expected}");
    }
    let (sigma, expected) = (arm.smallest_singular_value(), plain.smallest_singular_value());
    let near = (sigma.powi(2) - expected.powi(2)).abs() < NEAR_SINGULAR_TWICE;
    assert!(near, "sigma {sigma} instead of {expected}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(10_000))]

    #[test]
    fn arms_singular_in_several_ways_agree_with_the_plain_step(
        rows in prop::collection::vec((-1..3i8, 0..3u8, 0..3u8), 6..9),
        theta in prop::collection::vec(prop_oneof![3 => (-2..3i8).prop_map(|turn| f64::from(turn) * FRAC_PI_2), 1 => -4.0..4.0f64], 8),
        goal in prop::collection::vec(-4.0..4.0f64, 8),
    ) {
        check_arm_of_right_angles(&rows, &theta, &goal);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn any_configuration_agrees_with_the_plain_step(
        theta in prop::array::uniform7(-4.0..4.0f64),
        goal in prop::array::uniform7(-4.0..4.0f64),
    ) {
        check(Convention::ModifiedDh, &puma_rows(), &theta[..6], &goal[..6]);
        check(Convention::StandardDh, &seven_rows(), &theta, &goal);
    }

    #[test]
    fn arms_of_any_length_agree_with_the_plain_step(
        rows in prop::collection::vec((-4.0..4.0f64, -0.5..0.5f64, -0.5..0.5f64, -6.0..6.0f64), 1..20),
        theta in prop::collection::vec(prop_oneof![-4.0..4.0f64, -1e5..1e5f64], 20),
        goal in prop::collection::vec(-4.0..4.0f64, 20),
    ) {
        let row = |(alpha, a, d, theta_offset)| DhRow { alpha, a, d, theta_offset };
        let rows: Vec<_> = rows.into_iter().map(row).collect();
        let (damping, theta, goal) = (controller().damping, &theta[..rows.len()], &goal[..rows.len()]);
        for convention in [Convention::ModifiedDh, Convention::StandardDh] {
            check_damped(damping, NEAR_WITH_ANY_ARM, convention, &rows, theta, goal);
        }
    }

    #[test]
    fn configurations_near_a_singularity_agree_with_the_plain_step(
        theta in prop::array::uniform6(-4.0..4.0f64),
        goal in prop::array::uniform6(-4.0..4.0f64),
        wrist in prop_oneof![-1e-8..1e-8f64, -1e-3..1e-3f64, -0.2..0.2f64],
    ) {
        let mut theta = theta;
        theta[4] = wrist;
        let damping = controller().damping;
        check_damped(damping, NEAR_BESIDE_SINGULARITY, Convention::ModifiedDh, &puma_rows(), &theta, &goal);
    }

    #[test]
    fn damping_of_several_singular_values_agrees_with_the_plain_step(
        theta in prop::array::uniform6(-4.0..4.0f64),
        goal in prop::array::uniform6(-4.0..4.0f64),
        max in 0.05..1.0f64,
        threshold in prop_oneof![0.05..3.0f64, 0.25..0.5f64],
    ) {
        check_damped(Damping { max, threshold }, NEAR_WITH_ANY_THRESHOLD, Convention::ModifiedDh, &puma_rows(), &theta, &goal);
    }
}
