//! Tests of the table of laws in [`dq_kinematics::control`]: the formula of each law, and the properties that the literature gives
//! for the laws with derived gains.

use crate::control::{Loop, pose, theta};
use crate::puma::{controller, puma};
use crate::tolerance::ALGEBRA;
use dq_algebra::UnitDualQuaternion;
use dq_kinematics::control::{
    Controller, Law, Map, PoseError, SignMemory, nearer_goal, pose_error, six_numbers,
};
use nalgebra::{DVector, Vector3, Vector6};

/// A free tool that moves with the law's twist.
struct FreeBody {
    controller: Controller,
    goal_from_tool: UnitDualQuaternion,
}

impl FreeBody {
    fn new(controller: Controller, error: Vector6<f64>) -> Self {
        Self { controller, goal_from_tool: UnitDualQuaternion::screw_exp(&error) }
    }

    /// Makes one step with the law's twist plus a disturbance.
    fn step(&mut self, disturbance: &Vector6<f64>, h: f64) {
        let twist = self.controller.body_twist(&self.goal_from_tool) + disturbance;
        self.goal_from_tool *= UnitDualQuaternion::screw_exp(&(twist * h));
    }

    fn error(&self) -> f64 {
        self.goal_from_tool.screw_log().norm()
    }
}

fn with_gain(law: Law, gain: f64) -> Controller {
    controller().with_law(law, gain)
}

/// Moves the arm between the start and the goal of the reference work. Returns the length of the path divided by the distance between
/// the two, and the overshoot \[mm\].
fn motion(law: Law, gain: f64, step: f64) -> (f64, f64) {
    let mut control = Loop::new(law, pose("theta_desired"));
    control.controller = with_gain(law, gain);
    let mut joints = theta("theta_initial");
    let start = pose("theta_initial").translation();
    let way = control.goal.translation() - start;
    let (mut point, mut length, mut overshoot) = (start, 0.0, 0.0_f64);
    for _ in 0..(10.0 / step) as usize {
        joints = control.step(&joints, step);
        let _ = control.velocity(&joints);
        length += (control.state.tool_point() - point).norm();
        point = control.state.tool_point();
        overshoot = overshoot.max((point - control.goal.translation()).dot(&way.normalize()));
    }
    (length / way.norm(), 1e3 * overshoot)
}

#[test]
fn curvature_overshoot_and_gain_come_from_the_transpose_not_from_r8() {
    let cases = [
        (Law::Diffc, 185.0, 5e-4, 1.252, 10.9),
        (Law::LogcTranspose, 20.0, 1e-3, 1.241, 10.7),
        (Law::DiffcInverse, 1.0, 2e-3, 1.136, 0.0),
        (Law::Logc, 1.0, 2e-3, 1.134, 0.0),
    ];
    for (law, gain, step, ratio, overshoot) in cases {
        let ours = motion(law, gain, step);
        assert!((ours.0 - ratio).abs() < 1e-3 && (ours.1 - overshoot).abs() < 0.1, "{law}: {ours:?}");
    }
}

#[test]
fn each_cell_of_the_table_is_its_map_times_its_error() {
    for law in Law::ALL {
        let mut control = Loop::new(law, pose("theta_desired"));
        control.controller = with_gain(law, 2.0);
        let velocity = control.velocity(&theta("theta_initial"));
        let jacobian = control.state.body_jacobian();
        let twist = control.controller.body_twist(&pose_error(&control.state, &control.goal));
        match law.map() {
            // The R⁸ difference is not a twist.
            Map::Transpose if law == Law::Diffc => {
                let difference = control.goal.to_vector8() - control.state.base_from_tool().to_vector8();
                let expected = control.state.pose_jacobian().transpose() * difference * 2.0;
                assert!((velocity - expected).norm() < ALGEBRA * 100.0);
            }
            Map::Transpose => {
                assert!((velocity - jacobian.transpose() * twist).norm() < ALGEBRA * 100.0, "{law}");
            }
            // The start is not a singular configuration.
            Map::DampedInverse => assert!((jacobian * velocity - twist).norm() < 1e-10, "{law}"),
        }
    }
}

#[test]
fn the_r8_twist_is_twice_the_vector_part_of_the_remaining_motion() {
    let (start, goal) = (pose("theta_initial"), pose("theta_desired"));
    let twist = Vector6::from(six_numbers(&PoseError::from(&(start.inverse() * goal)).difference()));
    let left = (start.inverse() * goal).to_vector8();
    let expected = 2.0 * Vector6::new(left[1], left[2], left[3], left[5], left[6], left[7]);
    assert!((twist - expected).norm() < ALGEBRA);
}

#[test]
fn all_errors_agree_to_first_order() {
    let error = 1e-4 * Vector6::new(0.3, -0.5, 0.2, 0.7, 0.1, -0.4);
    let seen = PoseError::from(&UnitDualQuaternion::screw_exp(&error));
    for twist in [seen.difference(), seen.screw_log(), seen.decoupled_log(), seen.vector_part()]
        .map(|twist| Vector6::from(six_numbers(&twist)))
    {
        assert!((twist - error).norm() < error.norm_squared(), "{twist}");
    }
}

#[test]
fn lq_minimizes_its_cost() {
    let weights = [2.0, 5.0];
    // Near the goal, the cost is defined with this error.
    let start = 1e-3 * Vector6::new(0.3, -0.5, 0.2, 0.7, 0.1, -0.4);
    let cost = |weight_factor: f64| {
        let lq = controller().with_gains(Law::Lq, weights.map(|weight| weight_factor * weight));
        let mut body = FreeBody::new(lq, start);
        let mut sum = 0.0;
        for _ in 0..10_000 {
            let (error, twist) = (
                Vector6::from(six_numbers(&PoseError::from(&body.goal_from_tool.inverse()).difference())),
                body.controller.body_twist(&body.goal_from_tool),
            );
            let part = |rows: usize| error.fixed_rows::<3>(rows).norm_squared();
            sum += 1e-3 * (weights[0] * part(0) + weights[1] * part(3) + twist.norm_squared());
            body.step(&Vector6::zeros(), 1e-3);
        }
        sum
    };
    let best = cost(1.0);
    assert!(best < cost(0.8) && best < cost(1.25));
    // The value function of the Riccati equation is eᵀ √Q e.
    let expected = 2.0_f64.sqrt() * start.fixed_rows::<3>(0).norm_squared()
        + 5.0_f64.sqrt() * start.fixed_rows::<3>(3).norm_squared();
    assert!((best / expected - 1.0).abs() < 1e-2, "{best} {expected}");
}

#[test]
fn h_infinity_keeps_its_bounds_which_less_gain_does_not() {
    let bounds = [0.4_f64, 0.7];
    // The energy of the output as a fraction of its bound, under two equal disturbances that change slowly.
    let shares = |gain_factor: f64| {
        let law = controller().with_gains(Law::HInfinity, bounds.map(|bound| bound / gain_factor));
        let mut body = FreeBody::new(law, Vector6::zeros());
        let (mut rotation, mut position, mut disturbance) = (0.0, 0.0, 0.0);
        for k in 0..60_000 {
            let time = 1e-3 * f64::from(k);
            // The disturbance begins and ends at 0, so that the energy is finite.
            let one = 0.3 * (std::f64::consts::PI * time / 60.0).sin().powi(2);
            rotation += body.goal_from_tool.real().imag().norm_squared();
            position += body.goal_from_tool.translation().norm_squared();
            disturbance += 2.0 * one * one;
            let push = body.goal_from_tool.rotation().inverse() * Vector3::x();
            body.step(&(2.0 * one * Vector6::new(1.0, 0.0, 0.0, push.x, push.y, push.z)), 1e-3);
        }
        [rotation / (bounds[0].powi(2) * disturbance), position / (bounds[1].powi(2) * disturbance)]
    };
    assert!(shares(1.0).iter().all(|share| (0.9..=1.0).contains(share)), "{:?}", shares(1.0));
    assert!(shares(0.8).iter().all(|share| *share > 1.0), "{:?}", shares(0.8));
}

#[test]
fn predefined_time_arrives_in_its_time_from_any_distance() {
    for size in [0.01, 0.5, 2.0, 4.0, 50.0] {
        let law = controller().with_gains(Law::PredefinedTime, [2.0, 1e9]);
        let mut body =
            FreeBody::new(law, size * Vector6::new(0.0, 0.0, 0.06, 0.0, 0.8, 0.596_99).normalize());
        let (start, h, mut steps) = (body.error(), 1e-5, 0);
        while body.error() > 1e-3 {
            body.step(&Vector6::zeros(), h);
            steps += 1;
        }
        // (2T/π)(atan √x₀ − atan √x₁)
        let expected = 4.0 / std::f64::consts::PI * (start.sqrt().atan() - 1e-3_f64.sqrt().atan());
        let time = f64::from(steps) * h;
        assert!((time - expected).abs() < 1e-3 && time < 2.0, "from {size}: {time} {expected}");
    }
}

#[test]
fn the_gain_of_predefined_time_is_limited() {
    let gain =
        |size: f64| Law::PredefinedTime.twist_gains([2.0, 7.0], &(Vector3::zeros(), size * Vector3::x()))[0];
    assert_eq!((gain(1e-9), gain(0.0)), (7.0, 7.0));
    assert!((gain(1.0) - std::f64::consts::PI).abs() < ALGEBRA);
    let mut control = Loop::new(Law::PredefinedTime, pose("theta_desired"));
    assert!(control.velocity(&theta("theta_desired")).amax() < 1e-12);
}

/// Returns a rotation about z by `angle` \[rad\]. A full turn changes the sign of its quaternion.
fn turned(angle: f64) -> UnitDualQuaternion {
    UnitDualQuaternion::from_translation_angle_axis(Vector3::zeros(), angle, &Vector3::z_axis())
}

/// Turns a tool from `angle` \[rad\] to 0 by logc, with the worst measurement error of ±`noise` \[rad\]. The error always shifts the
/// measured angle toward the other side of the half turn. Returns how far the tool has turned in 10 s \[rad\], and how often the sign
/// has changed.
fn turn_with_noise(angle: f64, noise: f64, hysteresis: Option<f64>) -> (f64, u32) {
    let (goal, law) = (turned(0.0), with_gain(Law::Logc, 1.0));
    let (mut at, mut turned_by, mut flips) = (angle, 0.0, 0);
    let mut memory = SignMemory::nearest(&goal, &turned(angle));
    for _ in 0..10_000 {
        let wrong = if at < std::f64::consts::PI { noise } else { -noise };
        let seen = turned(at + wrong);
        let before = memory.sign();
        let goal = match hysteresis {
            Some(hysteresis) => memory.apply(&goal, &seen, hysteresis),
            None => {
                memory = SignMemory::nearest(&goal, &seen);
                memory.apply(&goal, &seen, 1.0)
            }
        };
        flips += u32::from(memory.sign() != before);
        let speed = law.body_twist(&(goal.inverse() * seen))[2];
        at += 1e-3 * speed;
        turned_by += (1e-3 * speed).abs();
    }
    (turned_by, flips)
}

#[test]
fn without_the_sign_rule_a_tool_unwinds_the_long_way_round() {
    // 10° before a full turn of the quaternion: close to the goal, but with the other sign.
    let nearly = 2.0 * std::f64::consts::PI - 10.0_f64.to_radians();
    let law = with_gain(Law::Logc, 1.0);
    let unwinding = law.body_twist(&turned(nearly))[2];
    assert!((unwinding + nearly).abs() < 1e-12, "back by {unwinding}");
    let (way, flips) = turn_with_noise(nearly, 0.0, Some(0.1));
    assert!(way < 10.1_f64.to_radians() && flips == 0, "{way} {flips}");
}

#[test]
fn without_memory_noise_at_a_half_turn_makes_the_tool_chatter() {
    let (start, noise) = (std::f64::consts::PI - 1e-3, 0.02);
    let (way, flips) = turn_with_noise(start, noise, None);
    assert!(flips > 100, "{flips} changes of direction, {way} rad");
    let (way, flips) = turn_with_noise(start, noise, Some(0.1));
    assert!(
        flips <= 1 && (way - std::f64::consts::PI).abs() < 0.3,
        "{flips} changes of direction, {way} rad"
    );
}

/// Checks that diffc_inverse, with the error `q* q_d − 1`, is not the law `J₈⁺ (q_d − q)` with the 8×n pose Jacobian J₈. The joint
/// velocities of the two laws differ by more than 40 % in the median of 201 random pairs of a start and a goal.
#[test]
fn the_inverse_of_the_difference_in_r8_is_not_diffc_inverse() {
    let mut random = 1_u64;
    let mut angle = || {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((random >> 11) as f64 / (1_u64 << 52) as f64 - 1.0) * std::f64::consts::PI
    };
    let mut apart = Vec::new();
    for _ in 0..201 {
        let [from, to] = [(); 2].map(|()| DVector::from_fn(6, |_, _| angle()));
        let [here, goal] = [&from, &to].map(|theta| puma().forward_kinematics(theta.as_slice()).unwrap());
        let mut control = Loop::new(Law::DiffcInverse, nearer_goal(&goal, &here));
        control.controller = with_gain(Law::DiffcInverse, 1.0);
        let ours = control.velocity(&from);
        let difference = control.goal.to_vector8() - here.to_vector8();
        let theirs = control.state.pose_jacobian().pseudo_inverse(1e-9).unwrap() * difference;
        apart.push((&theirs - &ours).norm() / ours.norm());
    }
    apart.sort_by(f64::total_cmp);
    assert!(apart[100] > 0.4, "{}", apart[100]);
}
