//! The second-order law logc_pd has the properties of the PD law on SE(3) from the paper's §10.2 and from Bullo & Murray (1995).

use crate::puma::{controller, puma};
use dq_kinematics::arm::ArmState;
use dq_kinematics::control::{Law, LawMemory, pose_error};
use nalgebra::Vector6;

/// Returns the fraction of the distance that remains `time` \[s\] after the start of a motion. The motion begins at rest and obeys
/// `ẍ + K_d ẋ + K_p x = 0`.
fn left(k_p: f64, k_d: f64, time: f64) -> f64 {
    let (decay, square) = (0.5 * k_d, 0.25 * k_d * k_d - k_p);
    let root = square.abs().sqrt();
    match square {
        square if square.abs() < 1e-12 => (1.0 + decay * time) * (-decay * time).exp(),
        square if square > 0.0 => {
            (-decay * time).exp() * ((root * time).cosh() + decay / root * (root * time).sinh())
        }
        _ => (-decay * time).exp() * ((root * time).cos() + decay / root * (root * time).sin()),
    }
}

/// Moves the PUMA 560 for 3 s to a goal that is a rotation of 0.5 rad away, without passing a singularity. Returns the time and the
/// error at each step.
fn errors(gains: [f64; 2], period: f64) -> Vec<(f64, Vector6<f64>)> {
    let (chain, controller) = (puma(), controller().with_gains(Law::LogcPd, gains));
    let mut joints = vec![0.1, -1.0, 0.2, 0.3, 0.9, 0.1];
    let goal = chain.forward_kinematics(&[0.4, -0.8, 0.0, 0.1, 1.1, 0.3]).unwrap();
    let (mut arm, mut memory) = (ArmState::new(&chain), LawMemory::default());
    let (mut command, mut before) = ([0.0; 6], [0.0; 6]);
    let mut errors = Vec::new();
    for cycle in 0..(3.0 / period) as u32 {
        chain.evaluate(&joints, &mut arm).unwrap();
        if cycle % 500 == 0 {
            errors.push((f64::from(cycle) * period, pose_error(&arm, &goal).screw_log()));
        }
        memory.joint_velocity(&controller, &arm, &goal, (&before, period), &mut command);
        before = command;
        joints.iter_mut().zip(&command).for_each(|(angle, speed)| *angle += period * speed);
    }
    errors
}

#[test]
fn from_rest_the_tool_moves_on_one_screw_like_a_damped_spring() {
    for [k_p, k_d] in [[4.0, 4.0], [4.0, 10.0], [9.0, 2.0]] {
        let errors = errors([k_p, k_d], 2e-4);
        let start = errors[0].1;
        for (time, error) in &errors {
            let expected = start * left(k_p, k_d, *time);
            assert!((error - expected).norm() < 2e-3 * start.norm(), "{k_p} {k_d} after {time} s");
        }
    }
}

#[test]
fn critical_damping_does_not_overshoot_and_less_damping_does() {
    let least = |gains| {
        let errors = errors(gains, 1e-3);
        let start = errors[0].1;
        errors.iter().map(|(_, error)| error.dot(&start) / start.norm_squared()).fold(1.0, f64::min)
    };
    assert!(least([4.0, 4.0]) > 0.0);
    // The first swing at ζ = ⅓ overshoots by exp(−π ζ/√(1−ζ²)) = 0.329.
    let swing = least([9.0, 2.0]);
    assert!((swing + 0.329).abs() < 0.02, "{swing}");
}
