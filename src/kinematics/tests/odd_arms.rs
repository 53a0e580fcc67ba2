//! Arms with an odd number of joints. They are a special case because the program computes joints in pairs.

use crate::jacobians::{FINITE_DIFFERENCE, state};
use crate::tolerance::ALGEBRA;
use dq_algebra::UnitDualQuaternion;
use dq_kinematics::arm::{ArmState, Chain, Joint, JointKind};
use nalgebra::{Unit, Vector3};

fn joint(kind: JointKind, along: Vector3<f64>, axis: Vector3<f64>) -> Joint {
    Joint {
        kind,
        parent_from_joint: UnitDualQuaternion::from_translation_angle_axis(along, 0.4, &Vector3::y_axis()),
        axis: Unit::new_normalize(axis),
    }
}

/// Checks two arms of three joints. Because the program computes joints in pairs, the last pair of each arm has a single joint. If
/// both arms are treated as one arm, the second pair has the last joint of the left arm and the first joint of the right arm.
#[test]
fn arms_with_an_odd_number_of_joints_keep_their_order() {
    let joints = [
        joint(JointKind::Revolute, Vector3::new(0.1, 0.0, 0.3), Vector3::z()),
        joint(JointKind::Prismatic, Vector3::new(0.2, 0.1, 0.0), Vector3::new(1.0, 1.0, 0.0)),
        joint(JointKind::Prismatic, Vector3::new(0.0, 0.3, 0.1), Vector3::new(0.0, 1.0, 2.0)),
    ];
    let chain = Chain::from_joints(&joints, &UnitDualQuaternion::identity()).unwrap();
    let at = |theta: &[f64]| ArmState::relative(&state(&chain, &theta[..3]), &state(&chain, &theta[3..]));
    let theta = [0.3, 0.2, -0.1, 0.7, 0.1, 0.4];
    let arms = at(&theta);
    assert_eq!(arms.joint_count(), 6);
    let step = 1e-6;
    for (i, column) in arms.pose_jacobian().column_iter().enumerate() {
        let (mut before, mut after) = (theta, theta);
        (before[i], after[i]) = (theta[i] - step, theta[i] + step);
        let numbers = |theta: &[f64]| at(theta).base_from_tool().to_vector8();
        let difference = (numbers(&after) - numbers(&before)) / (2.0 * step);
        assert!((column - difference).norm() < FINITE_DIFFERENCE, "column {i}: {column} {difference}");
    }
    let twist = arms.tool_twist(&[1.0; 6]);
    let expected = arms
        .tool_motions()
        .fold((Vector3::zeros(), Vector3::zeros()), |sum, motion| (sum.0 + motion.0, sum.1 + motion.1));
    assert!((twist.0 - expected.0).norm() + (twist.1 - expected.1).norm() < ALGEBRA);
}

/// Returns a chain of joints of these kinds.
fn chain(kinds: &[JointKind]) -> Chain {
    let joints: Vec<_> = kinds
        .iter()
        .map(|kind| joint(*kind, Vector3::new(0.1, 0.2, 0.3), Vector3::new(1.0, 2.0, 3.0)))
        .collect();
    Chain::from_joints(&joints, &UnitDualQuaternion::identity()).unwrap()
}

#[test]
fn evaluating_an_arm_overwrites_a_state_of_any_other_arm() {
    use JointKind::{Prismatic, Revolute};
    let theta = [0.3, 0.2, -0.1];
    let orders = [[Revolute; 3], [Prismatic, Revolute, Prismatic], [Revolute, Prismatic, Revolute]];
    let state = |kinds: &[JointKind]| crate::jacobians::state(&chain(kinds), &theta[..kinds.len()]);
    for (one, other) in orders.iter().flat_map(|one| orders.map(|other| (one, other))) {
        let mut used = state(&other);
        chain(one).evaluate(&theta, &mut used).unwrap();
        assert_eq!(used, state(one), "{one:?} after {other:?}");
        assert!(
            used.tool_motions().zip(one).all(|((turn, _), kind)| (turn.norm() > 0.5) == (*kind == Revolute))
        );
        let arms = |kinds: &[JointKind]| ArmState::relative(&state(kinds), &state(&other));
        let mut used = arms(&other);
        used.set_relative(&state(one), &state(&other));
        assert_eq!(used, arms(one), "{one:?} as the left arm after {other:?}");
        // The other state may have more or fewer joints.
        for count in [1, 2] {
            let mut used = arms(&other[..count]);
            used.set_relative(&state(one), &state(&other));
            assert_eq!(used, arms(one));
            used.set_relative(&state(&other[..count]), &state(&other));
            assert_eq!(used, arms(&other[..count]));
        }
    }
    let error = chain(&orders[0]).evaluate(&theta, &mut state(&[Revolute; 4][..2])).unwrap_err();
    assert_eq!(error.to_string(), "got 2 joint values, expected 3: the arm has 3 joints");
}
