//! Two arms as one: the law against the reference work, and the cycle that runs it.

use crate::reference::{distance, json, numbers, puma, rows};
use crate::rig::Rig;
use crate::tolerance::{ALGEBRA, FINITE_DIFFERENCE, LOOP, REFERENCE};
use dq_servo::arm::{ArmState, Chain};
use dq_servo::control::{Cooperative, Damping, Feedback, Primitive};
use dq_servo::dq::{Matrix8, UnitDualQuaternion, Vector8, dual_hamilton_minus, dual_hamilton_plus};
use dq_servo::servo::{Reason, Revocation, State};
use nalgebra::{DVector, Matrix4, Vector3, Vector4};
use proptest::prelude::*;

const PRIMITIVES: [Primitive; 4] = [
    Primitive::RelativePosition,
    Primitive::RelativeOrientation,
    Primitive::RelativePose,
    Primitive::RelativeDistance,
];

fn arms(left: &[f64], right: &[f64]) -> ArmState {
    let state = |chain: &Chain, theta: &[f64]| {
        let mut state = ArmState::new(chain);
        chain.evaluate(theta, &mut state).unwrap();
        state
    };
    ArmState::relative(&state(&puma(), left), &state(&puma(), right))
}

/// The paper's arms: β (left) at theta_desired, α (right) at theta_initial.
fn paper() -> Vec<f64> {
    [numbers(&json()["theta_desired"]), numbers(&json()["theta_initial"])].concat()
}

fn at(theta: &[f64]) -> ArmState {
    arms(&theta[..6], &theta[6..])
}

fn columns(primitive: Primitive, state: &ArmState) -> Vec<Vector8> {
    let mut columns = Vec::new();
    primitive.for_each_column(state, |column| columns.push(column));
    columns
}

/// The damped inverse of two arms by one decomposition of 8×8, with these columns and degrees of freedom: joint velocities and the
/// smallest singular value.
fn damped_by_modes(
    columns: &[Vector8],
    freedom: usize,
    damping: &Damping,
    error: &Vector8,
) -> (Vec<f64>, f64) {
    let gram = columns.iter().fold(Matrix8::zeros(), |sum, column| sum + column * column.transpose());
    let eigen = gram.symmetric_eigen();
    let mut order: Vec<_> = (0..8).collect();
    order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
    let modes = &order[..freedom];
    let smallest = eigen.eigenvalues[modes[freedom - 1]].max(0.0).sqrt();
    let lambda_squared = damping.lambda_squared(smallest);
    let solution: Vector8 = modes
        .iter()
        .map(|i| {
            let mode = eigen.eigenvectors.column(*i);
            mode * (mode.dot(error) / (eigen.eigenvalues[*i].max(0.0) + lambda_squared))
        })
        .sum();
    (columns.iter().map(|column| column.dot(&solution)).collect(), smallest)
}

/// The largest eigenvalue of `J Jᵀ`.
fn largest_square(columns: &[Vector8]) -> f64 {
    let gram = columns.iter().fold(Matrix8::zeros(), |sum, column| sum + column * column.transpose());
    gram.symmetric_eigenvalues().max()
}

fn law(primitive: Primitive, feedback: Feedback) -> Cooperative {
    let damping = Damping { max: 0.05, threshold: 0.05 };
    Cooperative { primitive, feedback, transpose_gain: 10.0, inverse_gain: 1.0, damping }
}

/// `theta` after `seconds` under the law, by Runge–Kutta steps of 1 ms.
fn follow(law: &Cooperative, goal: &UnitDualQuaternion, theta: &[f64], seconds: f64) -> Vec<f64> {
    let velocity = |theta: &DVector<f64>| {
        let mut velocity = DVector::zeros(12);
        law.joint_velocity(&at(theta.as_slice()), goal, velocity.as_mut_slice());
        velocity
    };
    let (mut theta, h) = (DVector::from_row_slice(theta), 1e-3);
    for _ in 0..(seconds / h).round() as usize {
        let k1 = velocity(&theta);
        let k2 = velocity(&(&theta + &k1 * (0.5 * h)));
        let k3 = velocity(&(&theta + &k2 * (0.5 * h)));
        let k4 = velocity(&(&theta + &k3 * h));
        theta += (k1 + 2.0 * k2 + 2.0 * k3 + k4) * (h / 6.0);
    }
    theta.as_slice().to_vec()
}

#[test]
fn printed_dual_position_jacobian_of_the_paper_is_met() {
    let columns = columns(Primitive::RelativePosition, &at(&paper()));
    let printed = rows(&json()["printed"]["dual_position_jacobian_columns_beta1to6_alpha1to6"]);
    // The paper keeps the scalar part of the translation, whose row is zero.
    for (i, printed) in printed.iter().enumerate().skip(1) {
        let ours: Vec<_> = columns.iter().map(|column| column[i - 1]).collect();
        assert!(distance(&ours, printed) < REFERENCE, "row {i}");
    }
    assert!(printed[0].iter().all(|x| x.abs() < REFERENCE));
}

/// `J_r = [H⁻₈(q₁) C₈ J₂, H⁺₈(q₂*) J₁]` with C the conjugation as a matrix (eq. 22; Adorno et al. 2010).
#[test]
fn the_relative_pose_jacobian_is_that_of_hamilton_operators() {
    let state = |theta: &str| {
        let mut state = ArmState::new(&puma());
        puma().evaluate(&numbers(&json()[theta]), &mut state).unwrap();
        state
    };
    let (beta, alpha) = (state("theta_desired"), state("theta_initial"));
    let (q2, q1) = (beta.base_from_tool(), alpha.base_from_tool());
    let c4 = Matrix4::from_diagonal(&Vector4::new(1.0, -1.0, -1.0, -1.0));
    let mut conjugated = beta.pose_jacobian();
    conjugated.rows_mut(0, 4).copy_from(&(c4 * beta.pose_jacobian().rows(0, 4)));
    conjugated.rows_mut(4, 4).copy_from(&(c4 * beta.pose_jacobian().rows(4, 4)));
    let of_beta = dual_hamilton_minus(q1.as_dual_quaternion()) * conjugated;
    let of_alpha = dual_hamilton_plus(q2.conjugate().as_dual_quaternion()) * alpha.pose_jacobian();
    let relative = ArmState::relative(&beta, &alpha);
    let ours = relative.pose_jacobian();
    assert!((ours.columns(0, 6) - of_beta).norm() < ALGEBRA * 10.0);
    assert!((ours.columns(6, 6) - of_alpha).norm() < ALGEBRA * 10.0);
    let printed = numbers(&json()["printed"]["relative_q"]);
    assert!(distance(relative.base_from_tool().to_vector8().as_slice(), &printed) < REFERENCE);
}

#[test]
fn relative_position_with_gain_10_meets_the_computed_samples() {
    let computed = json()["computed"]["relative_position_K10"].clone();
    let start = paper();
    let relative = at(&start).base_from_tool();
    let goal = UnitDualQuaternion::from_parts(relative.rotation(), 2.0 * relative.translation());
    let law = law(Primitive::RelativePosition, Feedback::Transpose);
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

/// With the inverse, position and squared distance decay as `exp(−K t)`, and `tan(θ/4)` of the angle does.
#[test]
fn the_inverse_form_decays_at_its_gain() {
    let start = paper();
    let relative = at(&start).base_from_tool();
    let turn = UnitDualQuaternion::from_translation_angle_axis(Vector3::zeros(), 0.7, &Vector3::x_axis());
    let shift = Vector3::new(0.1, -0.05, 0.08);
    let goal = UnitDualQuaternion::from_parts((relative * turn).rotation(), relative.translation() + shift);
    let decay = (-0.5_f64).exp();
    for primitive in PRIMITIVES {
        let theta = follow(&law(primitive, Feedback::DampedInverse), &goal, &start, 0.5);
        let now = at(&theta).base_from_tool();
        let position = (goal.translation() - now.translation()).norm() / shift.norm();
        let angle = |pose: &UnitDualQuaternion| pose.rotation().angle_to(&goal.rotation());
        let quarter = (0.25 * angle(&now)).tan() / (0.25 * angle(&relative)).tan();
        let square =
            |pose: &UnitDualQuaternion| goal.translation().norm_squared() - pose.translation().norm_squared();
        match primitive {
            Primitive::RelativePosition => assert!((position - decay).abs() < LOOP),
            Primitive::RelativeOrientation => assert!((quarter - decay).abs() < LOOP),
            // Its error is a chord in R⁸: near, but not on, the exponential.
            Primitive::RelativePose => {
                assert!((position - decay).abs() < 0.05 && (quarter - decay).abs() < 0.05)
            }
            Primitive::RelativeDistance => assert!((square(&now) / square(&relative) - decay).abs() < LOOP),
        }
    }
}

#[test]
fn stretched_arms_get_finite_velocities() {
    let relative = at(&[0.0; 12]).base_from_tool();
    let goal = UnitDualQuaternion::from_parts(relative.rotation(), Vector3::new(0.3, 0.2, 0.1));
    for primitive in PRIMITIVES {
        for max in [0.05, 0.0] {
            let mut law = law(primitive, Feedback::DampedInverse);
            law.damping.max = max;
            let mut velocity = [0.0; 12];
            law.joint_velocity(&at(&[0.0; 12]), &goal, &mut velocity);
            assert!(velocity.iter().all(|x| x.is_finite()), "{primitive} with damping {max}: {velocity:?}");
        }
    }
}

#[test]
fn primitives_and_forms_have_names() {
    for name in Primitive::NAMES {
        assert_eq!(name.parse::<Primitive>().unwrap().name(), *name);
    }
    assert_eq!(Feedback::NAMES, ["transpose", "damped_inverse"]);
    let unknown = "relative".parse::<Primitive>().unwrap_err().to_string();
    assert!(unknown.contains("relative_distance"), "{unknown}");
}

/// The goal of the tests of the cycle: near the start, in position and orientation.
fn nearby(rig: &Rig<dq_servo::servo::TwoArms>) -> UnitDualQuaternion {
    let turn = UnitDualQuaternion::from_translation_angle_axis(
        Vector3::new(0.05, 0.08, -0.06),
        0.4,
        &Vector3::y_axis(),
    );
    rig.servo.pose().unwrap() * turn
}

#[test]
fn every_primitive_arrives_in_both_forms_within_the_limits() {
    for primitive in PRIMITIVES {
        for feedback in [Feedback::Transpose, Feedback::DampedInverse] {
            let mut rig = Rig::two_arms();
            rig.change(|settings| settings.controller = law(primitive, feedback));
            rig.run(0.01);
            rig.goal_pose(&nearby(&rig));
            rig.run_until(State::Settled, 30.0);
            let figures = rig.servo.status().figures;
            assert!(
                figures.position_error <= 1e-3 && figures.rotation_error <= 1e-2,
                "{primitive} {feedback}"
            );
            assert!(figures.path_length > 1e-3 && rig.servo.smallest_singular_value() > 0.0);
        }
    }
}

#[test]
fn either_arm_silent_stops_both() {
    for silent in [0, 1] {
        let mut rig = Rig::two_arms();
        rig.run(0.01);
        rig.goal_pose(&nearby(&rig));
        rig.run(0.3);
        assert!(rig.speed() > 0.05);
        rig.connected[silent] = false;
        rig.run(0.104);
        assert_eq!(rig.state(), State::StaleState);
        rig.run(0.1);
        assert_eq!(rig.speed(), 0.0);
        rig.connected[silent] = true;
        rig.run_until(State::Settled, 30.0);
    }
}

#[test]
fn one_arm_alone_is_not_moved() {
    let mut rig = Rig::two_arms();
    rig.connected[1] = false;
    rig.servo.take_goal([0.1; 3], [0.0, 0.0, 0.0, 1.0], "left/tool0", rig.now).unwrap();
    rig.run(0.2);
    assert_eq!((rig.state(), rig.speed()), (State::WaitingForState, 0.0));
}

#[test]
fn pause_stop_and_changes_of_primitive_never_step_the_command() {
    let mut rig = Rig::two_arms();
    rig.run(0.01);
    rig.goal_pose(&nearby(&rig));
    for i in 0..40 {
        rig.run(0.05);
        rig.change(|settings| settings.controller.primitive = PRIMITIVES[i % 4]);
        rig.goal_pose(&nearby(&rig));
        rig.servo.pause(i % 9 == 0);
    }
    rig.servo.stop();
    rig.run(0.5);
    assert_eq!((rig.state(), rig.speed()), (State::Holding, 0.0));
}

#[test]
fn another_primitive_moves_nothing_until_somebody_asks_for_that() {
    let mut rig = Rig::two_arms();
    rig.run(0.01);
    let goal = nearby(&rig);
    rig.goal_pose(&goal);
    rig.run_until(State::Settled, 30.0);
    rig.change(|settings| settings.controller.primitive = Primitive::RelativePose);
    rig.run(1.0);
    assert_eq!((rig.state(), rig.speed()), (State::Holding, 0.0));
    assert_eq!(rig.servo.status().reason, Some(Reason::Revoked(Revocation::AnotherAim)));
    rig.goal_pose(&goal);
    rig.cycle();
    assert_eq!(rig.state(), State::Tracking);
    assert_eq!(rig.servo.status().figures.arrival_time, None);
    // In motion the arms come to rest.
    rig.run(0.1);
    assert!(rig.speed() > 0.0);
    rig.change(|settings| settings.controller.primitive = Primitive::RelativeDistance);
    rig.run(1.0);
    assert_eq!((rig.state(), rig.speed()), (State::Holding, 0.0));
}

#[test]
fn cartesian_limits_hold_for_both_tools() {
    let mut rig = Rig::two_arms();
    rig.change(|settings| settings.limits.linear_speed = 0.05);
    rig.run(0.01);
    rig.goal_pose(&nearby(&rig));
    let points = |rig: &Rig<dq_servo::servo::TwoArms>| {
        let tool = |arm: usize| puma().forward_kinematics(rig.plants[arm].positions()).unwrap().translation();
        [tool(0), tool(1)]
    };
    let mut last = points(&rig);
    let mut fastest = 0.0_f64;
    for _ in 0..500 {
        rig.cycle();
        let now = points(&rig);
        for arm in [0, 1] {
            fastest = fastest.max((now[arm] - last[arm]).norm() / crate::rig::PERIOD.as_secs_f64());
        }
        last = now;
    }
    assert!((0.04..0.0525).contains(&fastest), "{fastest}");
}

proptest! {
    #[test]
    fn jacobians_of_all_primitives_agree_with_finite_differences(
        theta in prop::collection::vec(-3.0..3.0f64, 12),
    ) {
        const STEP: f64 = 1e-6;
        let goal = UnitDualQuaternion::identity();
        for primitive in PRIMITIVES {
            let columns = columns(primitive, &at(&theta));
            for (i, column) in columns.iter().enumerate() {
                let error = |step: f64| {
                    let mut moved = theta.clone();
                    moved[i] += step;
                    primitive.error(&at(&moved).base_from_tool(), &goal)
                };
                let difference = (error(-STEP) - error(STEP)) / (2.0 * STEP);
                prop_assert!((difference - column).norm() < FINITE_DIFFERENCE, "{} joint {}", primitive, i);
            }
        }
    }

    #[test]
    fn the_damped_inverse_is_that_of_the_decomposed_8x8(
        theta in prop::collection::vec(-3.0..3.0f64, 12),
        goal in prop::collection::vec(-3.0..3.0f64, 12),
        threshold in prop_oneof![Just(0.05), Just(0.5)],
    ) {
        let (arms, goal) = (at(&theta), at(&goal).base_from_tool());
        for (primitive, freedom) in PRIMITIVES.into_iter().zip([3, 3, 6, 1]) {
            let damping = Damping { max: 0.05, threshold };
            let law = Cooperative { damping, ..law(primitive, Feedback::DampedInverse) };
            let error = primitive.error(&arms.base_from_tool(), &goal);
            let (expected, smallest) = damped_by_modes(&columns(primitive, &arms), freedom, &damping, &error);
            let sigma = law.smallest_singular_value(&arms);
            prop_assert!((sigma.powi(2) - smallest.powi(2)).abs() < REFERENCE, "{} {} {}", primitive, sigma, smallest);
            let mut ours = vec![0.0; 12];
            law.joint_velocity(&arms, &goal, &mut ours);
            let largest = expected.iter().fold(1.0_f64, |max, speed| max.max(speed.abs()));
            prop_assert!(distance(&ours, &expected) < 100.0 * REFERENCE * largest, "{}", primitive);
            let transpose = Cooperative { feedback: Feedback::Transpose, ..law };
            let rate = largest_square(&columns(primitive, &arms));
            prop_assert!((transpose.fastest_rate(&arms) - 10.0 * rate).abs() <= 10.0 * REFERENCE * rate, "{}", primitive);
        }
    }

    #[test]
    fn moving_both_bases_changes_nothing(theta in prop::collection::vec(-3.0..3.0f64, 12), t in prop::array::uniform3(-2.0..2.0f64)) {
        let place = UnitDualQuaternion::from_translation_angle_axis(Vector3::from(t), 1.0, &Vector3::y_axis());
        let state = |theta: &[f64], chain: Chain| {
            let mut state = ArmState::new(&chain);
            chain.evaluate(theta, &mut state).unwrap();
            state
        };
        let moved = |theta: &[f64]| state(theta, puma().standing_at(&place));
        let there = ArmState::relative(&moved(&theta[..6]), &moved(&theta[6..]));
        prop_assert!((there.pose_jacobian() - at(&theta).pose_jacobian()).norm() < 1e-11);
        prop_assert!((there.base_from_tool().to_vector8() - at(&theta).base_from_tool().to_vector8()).norm() < 1e-12);
        let chain = puma().standing_at(&place);
        let tool = chain.forward_kinematics(&theta[..6]).unwrap();
        prop_assert!((tool.translation() - chain.base_point()).norm() <= chain.reach(std::iter::empty()));
        prop_assert!((chain.base_point() - Vector3::from(t)).norm() < 1e-15);
    }
}
