//! Tests of how the laws reach a pose, a position, and a position with an axis.

use crate::aims::{LESS, missed, turned, z};
use crate::puma::{controller, puma};
use crate::reference::distance;
use dq_algebra::UnitDualQuaternion;
use dq_config::ForArm;
use dq_kinematics::arm::{ArmState, Chain};
use dq_kinematics::control::{Aim, Controller, Law};
use nalgebra::{UnitQuaternion, Vector3};
use proptest::prelude::*;
use std::f64::consts::PI;

fn random_pose() -> impl Strategy<Value = UnitDualQuaternion> {
    let numbers = prop::array::uniform3(-3.0..3.0f64);
    (numbers.clone(), numbers).prop_map(|(turn, point)| {
        UnitDualQuaternion::from_parts(UnitQuaternion::new(Vector3::from(turn)), Vector3::from(point))
    })
}

proptest! {
    #[test]
    fn the_nearest_pose_meets_the_goal_with_the_least_rotation(
        goal in random_pose(), tool in random_pose(), spin in -3.0..3.0f64
    ) {
        for aim in LESS {
            let nearest = aim.nearest(&goal, &tool);
            let (way, angle) = missed(aim, &nearest, &goal);
            prop_assert!(way < 1e-12 && angle < 1e-7, "{aim}: {way} {angle}");
            let turn = nearest.rotation().angle_to(&tool.rotation());
            prop_assert!((turn - aim.angle(&goal, &tool)).abs() < 1e-7, "{aim}");
            // Goals that are equal in the components of the aim are equally near. None of them is nearer than `nearest`.
            let as_good = turned(&goal, Vector3::z() * spin);
            prop_assert!(turn <= as_good.rotation().angle_to(&tool.rotation()) + 1e-7, "{aim}");
            let same = aim.nearest(&as_good, &tool);
            prop_assert!((same.to_vector8() - nearest.to_vector8()).norm() < 1e-9, "{aim}");
            prop_assert!((aim.nearest(&-goal, &tool).to_vector8() - nearest.to_vector8()).norm() < 1e-12);
        }
        prop_assert_eq!(Aim::Pose.nearest(&goal, &tool), goal);
    }

    #[test]
    fn each_law_reduces_the_error_within_the_aim_and_ignores_the_rest(
        theta in prop::array::uniform6(-1.5..1.5f64), by in prop::array::uniform3(-0.4..0.4f64)
    ) {
        let (chain, mut state) = (puma(), ArmState::new(&puma()));
        chain.evaluate(&theta, &mut state).unwrap();
        let tool = state.base_from_tool();
        let goal = UnitDualQuaternion::from_parts(
            UnitQuaternion::new(Vector3::from(by)) * tool.rotation(),
            tool.translation() + Vector3::new(0.02, -0.03, 0.01),
        );
        for (law, aim) in Law::ALL.into_iter().flat_map(|law| LESS.map(|aim| (law, aim))) {
            let control = Controller { law, aim, ..controller() };
            prop_assume!(control.smallest_singular_value(&state) > control.damping.threshold);
            let mut velocity = [0.0; 6];
            control.joint_velocity(&state, &goal, &mut velocity);
            // The law reduces the errors. Its velocities are the same for a goal that is equal in the components of the aim.
            let as_good = turned(&goal, Vector3::z() * 0.7);
            let mut other = [0.0; 6];
            control.joint_velocity(&state, &as_good, &mut other);
            let difference = velocity.iter().zip(&other).map(|(one, other)| (one - other).abs());
            prop_assert!(difference.sum::<f64>() < 1e-9 * (1.0 + control.gain()), "{law} {aim}");
            let mut descent = [0.0; 6];
            control.steepest_descent(&state, &goal, &mut descent);
            let gained: f64 = velocity.iter().zip(&descent).map(|(one, other)| one * other).sum();
            prop_assert!(gained > 0.0, "{law} {aim}: {gained}");
        }
    }

    #[test]
    fn a_free_motion_does_not_move_the_components_of_the_aim(
        theta in prop::array::uniform7(-1.5..1.5f64), wanted in prop::array::uniform7(-1.0..1.0f64),
        part in prop::sample::select(vec![1.0, 1e-2, 1e-6, 0.0])
    ) {
        // With all joints at 0, both arms are singular.
        let theta = theta.map(|angle| part * angle);
        let panda = Chain::for_arm("panda").unwrap();
        for (chain, aim) in [(puma(), Aim::Position), (puma(), Aim::PositionAndAxis), (panda, Aim::Pose)] {
            let (mut state, joints) = (ArmState::new(&chain), chain.joint_count());
            chain.evaluate(&theta[..joints], &mut state).unwrap();
            let control = Controller { aim, ..controller() };
            let is_regular = control.smallest_singular_value(&state) > control.damping.threshold;
            let tolerance = if is_regular { 1e-10 } else { 1e-6 };
            let mut free = wanted[..joints].to_vec();
            aim.leave_tool(&state, &mut free);
            let (angular, linear) = aim.part_of(&state, &state.tool_twist(&free));
            prop_assert!(linear.norm() < tolerance && angular.norm() < tolerance, "{aim}: {angular} {linear}");
            // This is a projection: applied again, it changes nothing.
            let mut again = free.clone();
            aim.leave_tool(&state, &mut again);
            prop_assert!(!is_regular || distance(&free, &again) < 1e-10, "{aim}");
        }
    }
}

#[test]
fn with_the_damped_inverse_errors_decay_at_the_gains_of_the_law() {
    let (chain, mut state) = (puma(), ArmState::new(&puma()));
    chain.evaluate(&[0.3, -0.6, 0.4, 0.5, 0.8, -0.3], &mut state).unwrap();
    let tool = state.base_from_tool();
    let goal = UnitDualQuaternion::from_parts(
        UnitQuaternion::new(Vector3::new(0.5, -0.3, 0.9)) * tool.rotation(),
        tool.translation() + Vector3::new(0.1, 0.05, -0.02),
    );
    let mut velocity = [0.0; 6];
    for (law, aim) in [(Law::Logc, Aim::Position), (Law::DoubleGeodesic, Aim::PositionAndAxis)] {
        let mut control = Controller { law, aim, ..controller() };
        control.set_gains(Law::Logc, [9.0, 2.0]);
        control.set_gains(Law::DoubleGeodesic, [3.0, 2.0]);
        control.joint_velocity(&state, &goal, &mut velocity);
        let (angular, linear) = state.tool_twist(&velocity);
        assert!((linear - 2.0 * (goal.translation() - tool.translation())).norm() < 1e-9, "{law} {aim}");
        // The angle between the z axes closes at three times itself; a position alone has no angle.
        let rate = z(&tool).cross(&z(&goal)).normalize().dot(&angular);
        let expected = 3.0 * aim.angle(&goal, &tool);
        assert!(aim == Aim::Position || (rate - expected).abs() < 1e-9, "{rate} {expected}");
        assert_eq!(
            control.fastest_rates(&state, &goal),
            if aim == Aim::Position { [2.0, 0.0] } else { [2.0, 3.0] }
        );
    }
}

/// Checks that diffc with the aim `position` moves along the negative gradient of `½K|q_d − q|²`, as with the aim `pose`. The
/// goal q_d then has the orientation of the tool.
#[test]
fn diffc_to_a_position_is_the_gradient_of_the_difference() {
    let chain = puma();
    let theta = [0.3, -0.6, 0.4, 0.5, 0.8, -0.3];
    let goal = chain.forward_kinematics(&[0.5, -0.4, 0.1, 0.0, 0.3, 0.2]).unwrap();
    let control = Controller { law: Law::Diffc, aim: Aim::Position, ..controller() };
    let half_square = |theta: &[f64]| {
        let tool = chain.forward_kinematics(theta).unwrap();
        let nearest = Aim::Position.nearest(&goal, &tool);
        0.5 * control.gain() * (nearest.to_vector8() - tool.to_vector8()).norm_squared()
    };
    let mut state = ArmState::new(&chain);
    chain.evaluate(&theta, &mut state).unwrap();
    let mut velocity = [0.0; 6];
    control.joint_velocity(&state, &goal, &mut velocity);
    for joint in 0..6 {
        let at = |side: f64| {
            let mut beside = theta;
            beside[joint] += side;
            half_square(&beside)
        };
        let slope = (at(-1e-5) - at(1e-5)) / 2e-5;
        assert!((slope - velocity[joint]).abs() < 1e-6, "joint {joint}: {slope} {}", velocity[joint]);
    }
}

#[test]
fn opposite_axes_are_rotated_about_the_tools_own_x_axis() {
    let tool =
        UnitDualQuaternion::from_parts(UnitQuaternion::new(Vector3::new(0.2, 0.4, -0.3)), Vector3::x());
    let goal = turned(&tool, Vector3::x() * PI);
    let nearest = Aim::PositionAndAxis.nearest(&goal, &tool);
    assert!(missed(Aim::PositionAndAxis, &nearest, &goal).1 < 1e-9);
    assert!((Aim::PositionAndAxis.angle(&goal, &tool) - PI).abs() < 1e-9);
}
