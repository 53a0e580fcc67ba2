//! The laws in closed loop, without the servo's limits.

use crate::LOOP;
use crate::puma::{controller, puma};
use crate::reference::{distance, json, numbers};
use crate::tolerance::REFERENCE;
use dq_algebra::UnitDualQuaternion;
use dq_kinematics::arm::{ArmState, Chain};
use dq_kinematics::control::{
    Aim, AllowedRate, AngularLinear, ControlLaw, Controller, Damping, Law, PoseError, RegisterError,
    SignMemory, pose_error, register,
};
use nalgebra::{DMatrix, DVector, Vector6};
use proptest::prelude::*;

/// Makes one step of the classical Runge–Kutta method.
pub fn runge_kutta(
    theta: &DVector<f64>,
    h: f64,
    mut velocity: impl FnMut(&DVector<f64>) -> DVector<f64>,
) -> DVector<f64> {
    let k1 = velocity(theta);
    let k2 = velocity(&(theta + &k1 * (0.5 * h)));
    let k3 = velocity(&(theta + &k2 * (0.5 * h)));
    let k4 = velocity(&(theta + &k3 * h));
    theta + (k1 + 2.0 * k2 + 2.0 * k3 + k4) * (h / 6.0)
}

/// A law that moves an arm to a goal.
pub struct Loop {
    chain: Chain,
    pub controller: Controller,
    pub goal: UnitDualQuaternion,
    pub state: ArmState,
}

impl Loop {
    pub fn new(law: Law, goal: UnitDualQuaternion) -> Self {
        let chain = puma();
        let controller = Controller { law, ..controller() };
        Self { state: ArmState::new(&chain), chain, controller, goal }
    }

    pub fn velocity(&mut self, theta: &DVector<f64>) -> DVector<f64> {
        self.chain.evaluate(theta.as_slice(), &mut self.state).unwrap();
        let mut velocity = DVector::zeros(theta.len());
        self.controller.joint_velocity(&self.state, &self.goal, velocity.as_mut_slice());
        velocity
    }

    pub fn step(&mut self, theta: &DVector<f64>, h: f64) -> DVector<f64> {
        runge_kutta(theta, h, |theta| self.velocity(theta))
    }

    pub fn error(&mut self, theta: &DVector<f64>) -> Vector6<f64> {
        self.chain.evaluate(theta.as_slice(), &mut self.state).unwrap();
        pose_error(&self.state, &self.goal).screw_log()
    }
}

pub fn theta(name: &str) -> DVector<f64> {
    DVector::from_vec(numbers(&json()[name]))
}

pub fn pose(name: &str) -> UnitDualQuaternion {
    puma().forward_kinematics(theta(name).as_slice()).unwrap()
}

#[test]
fn diffc_with_gain_185_reproduces_the_computed_samples() {
    let samples = json()["computed"]["diffc_K185"]["samples"].clone();
    let mut control = Loop::new(Law::Diffc, pose("theta_desired"));
    let (mut joints, step) = (theta("theta_initial"), 5e-4);
    let mut steps = 0;
    let mut times: Vec<_> =
        samples.as_object().unwrap().keys().map(|key| key.parse::<f64>().unwrap()).collect();
    times.sort_by(f64::total_cmp);
    for time in times {
        while (f64::from(steps) + 0.5) * step < time {
            joints = control.step(&joints, step);
            steps += 1;
        }
        let sample = &samples[time.to_string()];
        assert!(distance(joints.as_slice(), &numbers(&sample["theta"])) < LOOP, "theta at {time} s");
        let _ = control.velocity(&joints);
        let error = control.goal.to_vector8() - control.state.base_from_tool().to_vector8();
        assert!(distance(error.as_slice(), &numbers(&sample["error8"])) < LOOP, "error at {time} s");
    }
}

#[test]
fn logc_crosses_the_elbow_singularity_and_arrives() {
    let mut control = Loop::new(Law::Logc, pose("theta_desired"));
    let mut joints = theta("theta_initial");
    let (mut peak, mut nearest) = (0.0_f64, f64::INFINITY);
    for _ in 0..10_000 {
        let velocity = control.velocity(&joints);
        peak = peak.max(velocity.amax());
        nearest = nearest.min(control.state.smallest_singular_value());
        joints = control.step(&joints, 1e-3);
    }
    assert!(nearest < 1e-3, "the motion meets the singularity, smallest singular value {nearest}");
    assert!(peak.is_finite() && peak < 5.0, "peak joint speed {peak}");
    assert!((joints - theta("theta_desired")).amax() < 1e-4);
}

#[test]
fn logc_with_equal_gains_decays_exponentially_on_one_screw() {
    let mut control = Loop::new(Law::Logc, pose("theta_desired"));
    control.controller.set_gains(Law::Logc, [1.5; 2]);
    // The arm stays away from singularities, and damping is off, so that only the law is tested.
    control.controller.damping.max = 0.0;
    let mut joints = theta("theta_desired") + DVector::from_vec(vec![0.1, -0.2, 0.15, 0.3, 0.2, -0.1]);
    let initial = control.error(&joints);
    for step in 1..=1000 {
        joints = control.step(&joints, 2e-3);
        let expected = initial * (-1.5 * 2e-3 * f64::from(step)).exp();
        assert!((control.error(&joints) - expected).norm() < 1e-9, "step {step}");
    }
}

#[test]
fn halving_the_step_divides_the_error_by_sixteen() {
    let end = |step: f64, count: usize| {
        let mut control = Loop::new(Law::Logc, pose("theta_desired"));
        let start = theta("theta_desired") + DVector::from_element(6, 0.2);
        (0..count).fold(start, |joints, _| control.step(&joints, step))
    };
    let exact = end(0.0125, 80);
    let (coarse, fine) = ((end(0.1, 10) - &exact).norm(), (end(0.05, 20) - &exact).norm());
    assert!((10.0..24.0).contains(&(coarse / fine)), "{coarse} / {fine}");
}

#[test]
fn double_geodesic_moves_the_tool_on_a_straight_line() {
    let mut control = Loop::new(Law::DoubleGeodesic, pose("theta_desired"));
    control.controller.damping.max = 0.0;
    let mut joints = theta("theta_desired") + DVector::from_vec(vec![0.2, -0.1, 0.15, 0.3, 0.2, -0.1]);
    let _ = control.velocity(&joints);
    let start = control.state.tool_point();
    let direction = (control.goal.translation() - start).normalize();
    for _ in 0..1000 {
        joints = control.step(&joints, 5e-3);
        let _ = control.velocity(&joints);
        let way = control.state.tool_point() - start;
        assert!((way - direction * way.dot(&direction)).norm() < 1e-9);
    }
    assert!(control.error(&joints).norm() < 1e-2);
}

#[test]
fn the_wrong_sign_leads_away_from_the_goal_and_the_rule_prevents_it() {
    let goal = pose("theta_desired");
    let start = theta("theta_desired") + DVector::from_element(6, 1e-3);
    let mut wrong = Loop::new(Law::Diffc, -goal);
    let away = (0..2000).fold(start.clone(), |joints, _| wrong.step(&joints, 5e-4));
    assert!((&away - &start).norm() > 0.5);
    let sign = SignMemory::nearest(&-goal, &goal).apply(&-goal, &goal, 0.1);
    let mut right = Loop::new(Law::Diffc, sign);
    let home = (0..2000).fold(start.clone(), |joints, _| right.step(&joints, 5e-4));
    assert!((&home - &theta("theta_desired")).norm() < (start - theta("theta_desired")).norm());
}

#[test]
fn the_sign_is_kept_within_the_hysteresis() {
    let goal = UnitDualQuaternion::identity();
    let turned = |angle: f64| {
        UnitDualQuaternion::from_translation_angle_axis(
            nalgebra::Vector3::zeros(),
            angle,
            &nalgebra::Vector3::z_axis(),
        )
    };
    let mut memory = SignMemory::nearest(&goal, &turned(3.0));
    let past_half_turn = 2.0 * (-0.09_f64).acos();
    memory.apply(&goal, &turned(past_half_turn), 0.1);
    assert_eq!(memory.sign(), 1.0);
    memory.apply(&goal, &turned(2.0 * (-0.11_f64).acos()), 0.1);
    assert_eq!(memory.sign(), -1.0);
    memory.apply(&goal, &turned(past_half_turn), 0.1);
    assert_eq!(memory.sign(), -1.0);
}

#[test]
fn damping_begins_at_its_threshold_and_is_largest_at_the_singularity() {
    let damping = Damping { max: 0.05, threshold: 0.1 };
    assert_eq!(damping.lambda_squared(0.1), 0.0);
    assert!((damping.lambda_squared(0.0) - 0.05_f64.powi(2)).abs() < REFERENCE);
    assert!((damping.lambda_squared(0.05) - 0.05_f64.powi(2) * 0.75).abs() < REFERENCE);
}

#[test]
fn at_a_singularity_velocities_are_finite_with_and_without_damping() {
    for max in [0.05, 0.0] {
        for law in Law::ALL {
            let mut control = Loop::new(law, pose("theta_desired"));
            control.controller.damping.max = max;
            // All joints at zero: the wrist is singular.
            let velocity = control.velocity(&DVector::zeros(6));
            assert!(velocity.iter().all(|x| x.is_finite()), "{law} with damping {max}");
        }
    }
}

#[test]
fn laws_have_names() {
    for (name, law) in Law::names().iter().zip(Law::ALL) {
        assert_eq!((name.parse(), law.name()), (Ok(law), *name));
    }
    assert!("pid".parse::<Law>().unwrap_err().to_string().contains("diffc, diffc_inverse, logc"));
}

#[test]
fn laws_can_be_registered_after_others_were_used() {
    struct Own(&'static str);
    impl ControlLaw for Own {
        fn name(&self) -> &'static str {
            self.0
        }
        fn error(&self, error: &PoseError) -> AngularLinear {
            error.screw_log()
        }
    }
    let before = (Law::all().len(), Controller::default());
    let [first, second] = ["first", "second"].map(|name| register(Box::leak(Box::new(Own(name)))).unwrap());
    assert_eq!(
        (Law::all().len(), "second".parse(), second.parameter()),
        (before.0 + 2, Ok(second), "gains.second")
    );
    assert_ne!(first, second);
    assert_eq!(before.1.gains(second), [1.0; 2], "a controller made before has the law's defaults");
    assert_eq!(register(&Own("first")).err(), Some(RegisterError::Name("first")));
}

proptest! {
    #[test]
    fn no_law_moves_an_arm_at_its_goal(joints in prop::array::uniform6(-3.0..3.0f64)) {
        for law in Law::ALL {
            let mut control = Loop::new(law, puma().forward_kinematics(&joints).unwrap());
            let velocity = control.velocity(&DVector::from_row_slice(&joints));
            prop_assert!(velocity.amax() < 1e-9);
        }
    }
}

/// Returns the largest eigenvalue of `J Jᵀ`.
fn largest_square(jacobian: &nalgebra::DMatrix<f64>) -> f64 {
    (jacobian * jacobian.transpose()).symmetric_eigenvalues().max()
}

proptest! {
    #[test]
    fn the_fastest_rate_is_gain_times_the_largest_eigenvalue(angles in prop::array::uniform6(-3.2..3.2f64), angular in 0.1..1e3f64, linear in 0.1..1e3f64) {
        let mut control = Loop::new(Law::Diffc, pose("theta_desired"));
        control.chain.evaluate(&angles, &mut control.state).unwrap();
        let rates = |controller: &Controller| controller.fastest_rates(&control.state, &control.goal);
        let rate = |controller: &Controller| rates(controller)[0];
        let columns = control.state.pose_jacobian();
        let pose_jacobian = nalgebra::DMatrix::from_fn(8, 6, |row, column| columns[(row, column)]);
        let plain = 185.0 * largest_square(&pose_jacobian);
        prop_assert!((rate(&control.controller) / plain - 1.0).abs() < 1e-12);
        let transposed = control.controller.with_gains(Law::LogcTranspose, [angular, linear]);
        let mut weighted = control.state.body_jacobian();
        weighted.rows_mut(0, 3).scale_mut(angular.sqrt());
        weighted.rows_mut(3, 3).scale_mut(linear.sqrt());
        let plain = largest_square(&nalgebra::DMatrix::from_fn(6, 6, |row, column| weighted[(row, column)]));
        prop_assert!((rate(&transposed) / plain - 1.0).abs() < 1e-12);
        let inverse = control.controller.with_gains(Law::Logc, [angular, linear]);
        prop_assert_eq!(rates(&inverse), [linear, angular]);
    }
}

#[test]
fn a_delay_slows_each_direction_to_the_allowed_rate() {
    let (start, goal) = (theta("theta_initial"), pose("theta_desired"));
    for law in [Law::Diffc, Law::LogcTranspose, Law::UnitQuaternionTranspose] {
        for aim in Aim::ALL {
            let mut control = Loop::new(law, goal);
            control.controller.aim = aim;
            let here = puma().forward_kinematics(start.as_slice()).unwrap();
            // Near the goal the law is `θ̇ = −M δθ`.
            control.goal = aim.nearest(&here, &here);
            let near = |control: &mut Loop, joint: usize| {
                let mut at = |side: f64| {
                    let mut beside = start.clone();
                    beside[joint] += side;
                    control.velocity(&beside)
                };
                (at(-1e-5) - at(1e-5)) / 2e-5
            };
            let columns: Vec<_> = (0..6).map(|joint| near(&mut control, joint)).collect();
            let rates = DMatrix::from_columns(&columns);
            let _ = control.velocity(&start);
            let [fastest, _] = control.controller.fastest_rates(&control.state, &control.goal);
            let allowed = 0.1 * fastest;
            let speeds = DVector::from_fn(6, |joint, _| (joint as f64 + 1.0).sin());
            let mut softened = speeds.clone();
            let rate = AllowedRate { part: allowed / fastest, largest: allowed };
            control.controller.soften(&control.state, &control.goal, rate, softened.as_mut_slice());
            let time = 1.0 / allowed - 1.0 / fastest;
            let expected = (DMatrix::identity(6, 6) + rates * time).lu().solve(&speeds).unwrap();
            assert!((softened - expected).norm() < 1e-4, "{law} {aim}");
        }
    }
}
