//! Two arms that are controlled as one: the law compared with the reference work (Sathuluri 2018).

use crate::LOOP;
use crate::arm::rows;
use crate::control::runge_kutta;
use crate::jacobians::{FINITE_DIFFERENCE, state};
use crate::puma::puma;
use crate::reference::{distance, json, numbers};
use crate::tolerance::{ALGEBRA, REFERENCE};
use dq_algebra::{UnitDualQuaternion, dual_hamilton_minus, dual_hamilton_plus};
use dq_kinematics::arm::ArmState;
use dq_kinematics::control::{Aim, Controller, Damping, Map};
use nalgebra::{DMatrix, DVector, Matrix4, Vector3, Vector4};
use proptest::prelude::*;

fn arms(left: &[f64], right: &[f64]) -> ArmState {
    ArmState::relative(&state(&puma(), left), &state(&puma(), right))
}

/// Returns the paper's joint positions: β (left) at theta_desired, α (right) at theta_initial.
fn paper() -> Vec<f64> {
    [numbers(&json()["theta_desired"]), numbers(&json()["theta_initial"])].concat()
}

fn at(theta: &[f64]) -> ArmState {
    arms(&theta[..6], &theta[6..])
}

const DAMPING: Damping = Damping { max: 0.05, threshold: 0.05 };

fn law(aim: Aim, map: Map) -> Controller {
    let gain = if map == Map::Transpose { 10.0 } else { 1.0 };
    Controller::of_two_arms(map, aim, gain, DAMPING)
}

/// Returns the rows of the tool's Jacobian for the angular velocity if `angular`, otherwise for the linear velocity.
fn jacobian(arms: &ArmState, angular: bool) -> DMatrix<f64> {
    let first = if angular { 0 } else { 3 };
    let columns: Vec<_> = arms.tool_columns().collect();
    DMatrix::from_fn(3, columns.len(), |row, column| columns[column][first + row])
}

/// Returns the joint positions `theta` after `seconds` under the law, by Runge–Kutta steps of 1 ms.
fn follow(law: &Controller, goal: &UnitDualQuaternion, theta: &[f64], seconds: f64) -> Vec<f64> {
    let velocity = |theta: &DVector<f64>| {
        let mut velocity = DVector::zeros(12);
        law.joint_velocity(&at(theta.as_slice()), goal, velocity.as_mut_slice());
        velocity
    };
    let (mut theta, h) = (DVector::from_row_slice(theta), 1e-3);
    for _ in 0..(seconds / h).round() as usize {
        theta = runge_kutta(&theta, h, velocity);
    }
    theta.as_slice().to_vec()
}

#[test]
fn the_printed_dual_position_jacobian_of_the_paper_is_reproduced() {
    let columns = jacobian(&at(&paper()), false);
    let printed = rows(&json()["printed"]["dual_position_jacobian_columns_beta1to6_alpha1to6"]);
    // The paper includes the scalar part of the translation, whose row is zero.
    for (i, printed) in printed.iter().enumerate().skip(1) {
        let ours: Vec<_> = columns.row(i - 1).iter().copied().collect();
        assert!(distance(&ours, printed) < REFERENCE, "row {i}");
    }
    assert!(printed[0].iter().all(|x| x.abs() < REFERENCE));
}

/// Checks that the Jacobian of the relative pose `q₂* q₁` is `[H⁻₈(q₁) C₈ J₂, H⁺₈(q₂*) J₁]` (eq. 22; Adorno et al. 2010). The 8×8
/// matrix C₈ conjugates a dual quaternion.
#[test]
fn the_relative_pose_jacobian_is_that_of_hamilton_operators() {
    let [beta, alpha] =
        ["theta_desired", "theta_initial"].map(|theta| state(&puma(), &numbers(&json()[theta])));
    let (q2, q1) = (beta.base_from_tool(), alpha.base_from_tool());
    let c4 = Matrix4::from_diagonal(&Vector4::new(1.0, -1.0, -1.0, -1.0));
    let mut conjugated = beta.pose_jacobian();
    conjugated.rows_mut(0, 4).copy_from(&(c4 * beta.pose_jacobian().rows(0, 4)));
    conjugated.rows_mut(4, 4).copy_from(&(c4 * beta.pose_jacobian().rows(4, 4)));
    let of_beta = dual_hamilton_minus(q1.as_dual_quaternion()) * conjugated;
    let of_alpha = dual_hamilton_plus(q2.inverse().as_dual_quaternion()) * alpha.pose_jacobian();
    let relative = ArmState::relative(&beta, &alpha);
    let ours = relative.pose_jacobian();
    assert!((ours.columns(0, 6) - of_beta).norm() < ALGEBRA * 10.0);
    assert!((ours.columns(6, 6) - of_alpha).norm() < ALGEBRA * 10.0);
    let printed = numbers(&json()["printed"]["relative_q"]);
    assert!(distance(relative.base_from_tool().to_vector8().as_slice(), &printed) < REFERENCE);
    let printed = numbers(&json()["printed"]["relative_translation_initial"]);
    assert!(distance(relative.tool_point().as_slice(), &printed) < REFERENCE);
}

#[test]
fn relative_position_with_gain_10_reproduces_the_computed_samples() {
    let computed = json()["computed"]["relative_position_K10"].clone();
    let start = paper();
    let relative = at(&start).base_from_tool();
    let goal = UnitDualQuaternion::from_parts(relative.rotation(), 2.0 * relative.translation());
    let law = law(Aim::Position, Map::Transpose);
    let (mut theta, mut time) = (start, 0.0);
    for sample in ["0", "1", "2", "5", "8", "10", "15"] {
        let until: f64 = sample.parse().unwrap();
        theta = follow(&law, &goal, &theta, until - time);
        time = until;
        let error = goal.translation() - at(&theta).tool_point();
        assert!(distance(error.as_slice(), &numbers(&computed["errors"][sample])) < LOOP, "at {sample} s");
    }
    assert!(distance(&theta, &numbers(&computed["theta_beta_alpha_15s"])) < LOOP);
}

/// Checks how fast the errors decay with the damped inverse as the map and the gain K. Errors of position and distance decay as
/// `exp(−K t)`. For an error of orientation by the angle θ, `tan(θ/4)` decays as `exp(−K t)`.
#[test]
fn the_inverse_form_decays_at_its_gain() {
    let start = paper();
    let relative = at(&start).base_from_tool();
    let turn = UnitDualQuaternion::from_translation_angle_axis(Vector3::zeros(), 0.7, &Vector3::x_axis());
    let shift = Vector3::new(0.1, -0.05, 0.08);
    let goal = UnitDualQuaternion::from_parts((relative * turn).rotation(), relative.translation() + shift);
    let decay = (-0.5_f64).exp();
    for aim in Aim::ALL {
        let theta = follow(&law(aim, Map::DampedInverse), &goal, &start, 0.5);
        let now = at(&theta).base_from_tool();
        let position = (goal.translation() - now.translation()).norm() / shift.norm();
        let angle = |pose: &UnitDualQuaternion| pose.rotation().angle_to(&goal.rotation());
        let quarter = (0.25 * angle(&now)).tan() / (0.25 * angle(&relative)).tan();
        let far = |pose: &UnitDualQuaternion| goal.translation().norm() - pose.translation().norm();
        match aim {
            Aim::Position => assert!((position - decay).abs() < LOOP),
            Aim::Orientation => assert!((quarter - decay).abs() < LOOP),
            // The position error is coupled with the rotation, so that it is close to the exponential but not equal to it.
            Aim::Pose => assert!((position - decay).abs() < 0.05 && (quarter - decay).abs() < LOOP),
            Aim::PositionAndAxis => assert!((position - decay).abs() < 0.05),
            Aim::Distance => assert!((far(&now) / far(&relative) - decay).abs() < LOOP),
        }
    }
}

#[test]
fn stretched_arms_get_finite_velocities() {
    let relative = at(&[0.0; 12]).base_from_tool();
    let goal = UnitDualQuaternion::from_parts(relative.rotation(), Vector3::new(0.3, 0.2, 0.1));
    for aim in Aim::ALL {
        for max in [0.05, 0.0] {
            let mut law = law(aim, Map::DampedInverse);
            law.damping.max = max;
            let mut velocity = [0.0; 12];
            law.joint_velocity(&at(&[0.0; 12]), &goal, &mut velocity);
            assert!(velocity.iter().all(|x: &f64| x.is_finite()), "{aim} with damping {max}: {velocity:?}");
        }
    }
}

#[test]
fn aims_of_two_arms_have_the_names_of_one_arm_with_a_prefix() {
    for (aim, name) in Aim::ALL.into_iter().zip(Aim::NAMES) {
        assert_eq!((aim.name(), aim.relative_name()), (*name, format!("relative_{name}").as_str()));
        assert_eq!(Aim::from_relative_name(aim.relative_name()), Some(aim));
    }
    assert_eq!(
        (Aim::from_relative_name("pose"), Map::NAMES),
        (None, ["transpose", "damped_inverse"].as_slice())
    );
}

proptest! {
    /// Checks that `Jᵀ K e` is the negative gradient of `½ K |e|²`. The error e is a difference as in eq. 16: of positions, of
    /// distances, of rotations in R⁴, or of poses in R⁸.
    #[test]
    fn the_transposed_form_descends_its_squared_error(
        theta in prop::collection::vec(-3.0..3.0f64, 12),
        goal in prop::collection::vec(-3.0..3.0f64, 12),
    ) {
        const STEP: f64 = 1e-6;
        let goal = at(&goal).base_from_tool();
        for aim in [Aim::Position, Aim::Distance, Aim::Orientation, Aim::Pose] {
            let law = law(aim, Map::Transpose);
            let squared = |theta: &[f64]| {
                let tool = at(theta).base_from_tool();
                let (now, wanted) = (tool.translation(), goal.translation());
                match aim {
                    Aim::Position => (wanted - now).norm_squared(),
                    Aim::Distance => (wanted.norm() - now.norm()).powi(2),
                    Aim::Orientation => (goal.real() - tool.real()).norm_squared(),
                    _ => (goal.to_vector8() - tool.to_vector8()).norm_squared(),
                }
            };
            let mut velocity = [0.0; 12];
            law.joint_velocity(&at(&theta), &goal, &mut velocity);
            for (joint, speed) in velocity.iter().enumerate() {
                let moved = |step: f64| {
                    let mut moved = theta.clone();
                    moved[joint] += step;
                    squared(&moved)
                };
                let descent = 0.5 * law.gain() * (moved(-STEP) - moved(STEP)) / (2.0 * STEP);
                prop_assert!((descent - speed).abs() < 100.0 * FINITE_DIFFERENCE, "{} joint {}", aim, joint);
            }
        }
    }

    /// Compares the inverse form with `Jᵀ (J Jᵀ + λ² I)⁻¹ K e`, computed by a matrix decomposition. J and e have only the rows
    /// that the aim controls.
    #[test]
    fn the_inverse_form_is_the_damped_inverse_of_the_rows_of_the_aim(
        theta in prop::collection::vec(-3.0..3.0f64, 12),
        goal in prop::collection::vec(-3.0..3.0f64, 12),
        threshold in prop_oneof![Just(0.05), Just(0.5)],
    ) {
        let (arms, goal) = (at(&theta), at(&goal).base_from_tool());
        let tool = arms.base_from_tool();
        let column = |v: Vector3<f64>| DMatrix::from_column_slice(3, 1, v.as_slice());
        let turn = goal.real() * tool.real().conjugate();
        let (point, wanted) = (tool.translation(), goal.translation());
        let along = DMatrix::from_row_slice(1, 3, (point / point.norm()).as_slice());
        for (aim, rows, error) in [
            (Aim::Position, jacobian(&arms, false), column(wanted - point)),
            (Aim::Orientation, jacobian(&arms, true), column(2.0 * turn.imag())),
            (Aim::Distance, &along * jacobian(&arms, false), DMatrix::from_element(1, 1, wanted.norm() - point.norm())),
        ] {
            let law = Controller { damping: Damping { threshold, ..DAMPING }, ..law(aim, Map::DampedInverse) };
            let gram = &rows * rows.transpose();
            let eigenvalues = gram.symmetric_eigenvalues();
            let (smallest, largest) = (eigenvalues.min().max(0.0).sqrt(), eigenvalues.max());
            prop_assert!((law.smallest_singular_value(&arms) - smallest).abs() < 1e-6, "{}", aim);
            let damped = gram + DMatrix::identity(rows.nrows(), rows.nrows()) * law.damping.lambda_squared(smallest);
            let expected = rows.transpose() * damped.try_inverse().unwrap() * error;
            let mut ours = vec![0.0; 12];
            law.joint_velocity(&arms, &goal, &mut ours);
            let most = expected.amax().max(1.0);
            prop_assert!(distance(&ours, expected.as_slice()) < 1e4 * REFERENCE * most, "{}", aim);
            let transpose = Controller { damping: law.damping, ..self::law(aim, Map::Transpose) };
            let quarter = if aim == Aim::Orientation { 0.25 } else { 1.0 };
            let rate = quarter * transpose.gain() * largest;
            let [fastest, _] = transpose.fastest_rates(&arms, &goal);
            prop_assert!((fastest - rate).abs() <= 10.0 * REFERENCE * rate, "{}: {} {}", aim, fastest, rate);
        }
    }

    #[test]
    fn moving_both_bases_changes_nothing(theta in prop::collection::vec(-3.0..3.0f64, 12), t in prop::array::uniform3(-2.0..2.0f64)) {
        let place = UnitDualQuaternion::from_translation_angle_axis(Vector3::from(t), 1.0, &Vector3::y_axis());
        let moved = |theta: &[f64]| state(&puma().standing_at(&place), theta);
        let there = ArmState::relative(&moved(&theta[..6]), &moved(&theta[6..]));
        prop_assert!((there.pose_jacobian() - at(&theta).pose_jacobian()).norm() < 1e-11);
        prop_assert!((there.base_from_tool().to_vector8() - at(&theta).base_from_tool().to_vector8()).norm() < 1e-12);
        let chain = puma().standing_at(&place);
        let tool = chain.forward_kinematics(&theta[..6]).unwrap();
        prop_assert!((tool.translation() - chain.base_point()).norm() <= chain.reach(std::iter::empty()));
        prop_assert!((chain.base_point() - Vector3::from(t)).norm() < 1e-15);
    }
}
