//! Forward kinematics and Jacobians.

use crate::jacobians::{check_jacobians, state};
use crate::puma::puma;
use crate::reference::{distance, json, numbers};
use crate::step::seven_rows;
use crate::tolerance::{ALGEBRA, REFERENCE};
use dq_algebra::UnitDualQuaternion;
use dq_kinematics::arm::{ArmError, Chain, Convention, DhRow, Joint, JointKind};
use nalgebra::{Unit, Vector3};
use proptest::prelude::*;
use serde_json::Value;

/// Returns the rows of a matrix given as a list of lists.
pub fn rows(value: &Value) -> Vec<Vec<f64>> {
    value.as_array().unwrap().iter().map(numbers).collect()
}

#[test]
fn printed_poses_of_the_paper_are_reproduced_with_their_signs() {
    let reference = json();
    for (theta, pose) in
        [("theta_initial", "q_initial"), ("theta_desired", "q_desired"), ("theta_third", "q_third")]
    {
        let q = puma().forward_kinematics(&numbers(&reference[theta])).unwrap();
        let printed = numbers(&reference["printed"][pose]);
        assert!(distance(q.to_vector8().as_slice(), &printed) < REFERENCE, "{pose}");
    }
    let third = puma().forward_kinematics(&numbers(&reference["theta_third"])).unwrap();
    let printed = numbers(&reference["printed"]["translation_third"]);
    assert!(distance(third.translation().as_slice(), &printed) < REFERENCE);
}

#[test]
fn the_computed_pose_jacobian_is_reproduced() {
    let reference = json();
    let jacobian = state(&puma(), &numbers(&reference["theta_initial"])).pose_jacobian();
    for (i, row) in rows(&reference["computed"]["jacobian8x6_initial"]).iter().enumerate() {
        let ours: Vec<_> = jacobian.row(i).iter().copied().collect();
        assert!(distance(&ours, row) < REFERENCE, "row {i}");
    }
}

#[test]
fn an_independent_implementation_agrees_on_poses_and_jacobians() {
    let cases: Value = serde_json::from_str(include_str!("../../../tests/data/dqrobotics.json")).unwrap();
    for case in cases.as_array().unwrap() {
        let column = |name: &str| numbers(&case[name]);
        let (alpha, a, d, theta) = (column("alpha"), column("a"), column("d"), column("theta"));
        let row = |i: usize| DhRow { alpha: alpha[i], a: a[i], d: d[i], theta_offset: 0.0 };
        let convention = case["convention"].as_str().unwrap().parse().unwrap();
        let chain = Chain::new(convention, &(0..theta.len()).map(row).collect::<Vec<_>>()).unwrap();
        let state = state(&chain, &theta);
        let pose = column("pose");
        // Both signs are the same pose. The Jacobian has the sign of its pose.
        let sign = (state.base_from_tool().to_vector8()[0] * pose[0]).signum();
        let ours = state.base_from_tool().to_vector8() * sign;
        assert!(distance(ours.as_slice(), &pose) < REFERENCE, "{theta:?}");
        for (i, row) in rows(&case["jacobian"]).iter().enumerate() {
            let ours: Vec<_> = (state.pose_jacobian().row(i) * sign).iter().copied().collect();
            assert!(distance(&ours, row) < REFERENCE, "row {i} at {theta:?}");
        }
    }
}

#[test]
fn standard_dh_is_the_product_of_its_factors() {
    let row = DhRow { alpha: 0.3, a: 0.2, d: 0.1, theta_offset: 0.5 };
    let chain = Chain::new(Convention::StandardDh, &[row]).unwrap();
    let turn =
        |angle: f64, axis| UnitDualQuaternion::from_translation_angle_axis(Vector3::zeros(), angle, &axis);
    let shift = |t| UnitDualQuaternion::from_translation_angle_axis(t, 0.0, &Vector3::z_axis());
    let expected = turn(1.2, Vector3::z_axis())
        * shift(Vector3::new(0.0, 0.0, 0.1))
        * shift(Vector3::new(0.2, 0.0, 0.0))
        * turn(0.3, Vector3::x_axis());
    let got = chain.forward_kinematics(&[0.7]).unwrap();
    assert!((got.to_vector8() - expected.to_vector8()).norm() < ALGEBRA);
}

/// An axis of zeros has no direction: `Unit::new_normalize` makes NaN of it.
#[test]
fn an_axis_without_a_direction_is_rejected() {
    let joint = |axis| Joint {
        kind: JointKind::Revolute,
        parent_from_joint: UnitDualQuaternion::identity(),
        axis: Unit::new_normalize(axis),
    };
    let joints = [joint(Vector3::x()), joint(Vector3::zeros())];
    let error = Chain::from_joints(&joints, &UnitDualQuaternion::identity()).unwrap_err();
    assert!(matches!(error, ArmError::NonFinite { parameter: "axis", joint: 2, .. }), "{error}");
}

#[test]
fn invalid_joint_counts_and_rows_are_rejected() {
    let error = puma().forward_kinematics(&[0.0; 5]).unwrap_err();
    assert_eq!(error, ArmError::JointCount { expected: 6, got: 5 });
    assert_eq!(Chain::new(Convention::ModifiedDh, &[]), Err(ArmError::NoJoints));
    let bad = DhRow { alpha: 0.0, a: f64::NAN, d: 0.0, theta_offset: 0.0 };
    assert!(matches!(
        Chain::new(Convention::ModifiedDh, &[bad]),
        Err(ArmError::NonFinite { parameter: "a", joint: 1, .. })
    ));
    assert!("craig".parse::<Convention>().is_err());
}

proptest! {
    #[test]
    fn jacobians_agree_with_finite_differences(theta in prop::array::uniform7(-3.0..3.0f64)) {
        check_jacobians(&puma(), &theta[..6]);
        check_jacobians(&Chain::new(Convention::StandardDh, &seven_rows()).unwrap(), &theta);
    }

    #[test]
    fn no_pose_is_beyond_reach(theta in prop::array::uniform7(-3.0..3.0f64)) {
        let chain = Chain::new(Convention::StandardDh, &seven_rows()).unwrap();
        prop_assert!(chain.forward_kinematics(&theta).unwrap().translation().norm() <= chain.reach(std::iter::empty()));
        let links = chain.link_poses(&theta).unwrap();
        let tool = *links.last().unwrap() * chain.last_link_from_tool();
        let expected = chain.forward_kinematics(&theta).unwrap();
        prop_assert!((tool.to_vector8() - expected.to_vector8()).norm() < ALGEBRA);
    }
}
