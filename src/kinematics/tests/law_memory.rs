//! Tests laws with a memory, such as an integral law. Their motions are compared with formulas.

use crate::puma::puma;
use dq_kinematics::arm::ArmState;
use dq_kinematics::control::{
    AngularLinear, ControlLaw, Controller, Law, LawMemory, MEMORY, PoseError, RegisterError, ToolMotion,
    pose_error, register,
};

/// The integral law `ξ = 2 X + ∫X dt` with the screw logarithm X.
struct Integral;

impl ControlLaw for Integral {
    fn name(&self) -> &'static str {
        "integral"
    }

    fn error(&self, error: &PoseError) -> AngularLinear {
        error.screw_log()
    }

    fn memory_size(&self) -> usize {
        6
    }

    fn twist_with_memory(&self, motion: &ToolMotion, memory: &mut [f64]) -> AngularLinear {
        let (angular, linear) = motion.error.screw_log();
        for (sum, error) in memory.iter_mut().zip(angular.iter().chain(&linear)) {
            *sum += motion.period * error;
        }
        let sum = |first: usize| nalgebra::Vector3::new(memory[first], memory[first + 1], memory[first + 2]);
        (2.0 * angular + sum(0), 2.0 * linear + sum(3))
    }
}

/// Moves the PUMA 560 with the law for `seconds` while each joint drifts at `drift` [rad/s]. Returns the errors of all cycles.
fn errors(law: Law, drift: f64, seconds: f64) -> Vec<f64> {
    let (chain, controller) = (puma(), Controller { law, ..Controller::default() });
    let goal = chain.forward_kinematics(&[0.4, -0.8, 0.0, 0.1, 1.1, 0.3]).unwrap();
    let mut joints = vec![0.1, -1.0, 0.2, 0.3, 0.9, 0.1];
    let (mut arm, mut memory, mut command) = (ArmState::new(&chain), LawMemory::default(), [0.0; 6]);
    let cycles = 0..(1000.0 * seconds) as u32;
    cycles
        .map(|_| {
            chain.evaluate(&joints, &mut arm).unwrap();
            let last = command;
            memory.joint_velocity(&controller, &arm, &goal, (&last, 1e-3), &mut command);
            joints.iter_mut().zip(&command).for_each(|(angle, speed)| *angle += 1e-3 * (speed + drift));
            pose_error(&arm, &goal).screw_log().norm()
        })
        .collect()
}

#[test]
fn an_integral_removes_the_error_that_a_drift_leaves() {
    let integral = register(&Integral).unwrap();
    let last = |law| *errors(law, 0.05, 20.0).last().unwrap();
    assert!(last(Law::Logc) > 1e-2, "{}", last(Law::Logc));
    assert!(last(integral) < 1e-6, "{}", last(integral));
    // `ẍ + 2 ẋ + x = 0` without a drift: `x = (1 − t) exp(−t)` for `ẋ(0) = −2`, which passes zero at 1 s.
    let errors = errors(integral, 0.0, 3.0);
    let at = |seconds: f64| errors[(1000.0 * seconds) as usize] / errors[0];
    for time in [0.5_f64, 0.9, 1.5, 2.5] {
        let expected = ((1.0 - time) * (-time).exp()).abs();
        assert!((at(time) - expected).abs() < 2e-3, "{time} s: {} instead of {expected}", at(time));
    }
}

#[test]
fn a_switch_of_the_law_begins_with_a_new_memory() {
    let (chain, mut arm) = (puma(), ArmState::new(&puma()));
    chain.evaluate(&[0.1, -1.0, 0.2, 0.3, 0.9, 0.1], &mut arm).unwrap();
    let goal = chain.forward_kinematics(&[0.4, -0.8, 0.0, 0.1, 1.1, 0.3]).unwrap();
    let mut memory = LawMemory::default();
    let mut step = |law| {
        let mut command = [0.0; 6];
        let controller = Controller { law, ..Controller::default() };
        memory.joint_velocity(&controller, &arm, &goal, (&[0.0; 6], 1e-3), &mut command);
        command
    };
    let first = step(Law::LogcPd);
    assert_ne!(step(Law::LogcPd), first);
    step(Law::Logc);
    assert_eq!(step(Law::LogcPd), first, "as at the beginning of a motion");
}

#[test]
fn a_law_with_too_large_a_memory_is_not_registered() {
    struct Large;
    impl ControlLaw for Large {
        fn name(&self) -> &'static str {
            "large"
        }
        fn error(&self, error: &PoseError) -> AngularLinear {
            error.screw_log()
        }
        fn memory_size(&self) -> usize {
            MEMORY + 1
        }
    }
    assert_eq!(register(&Large).err(), Some(RegisterError::Memory(MEMORY + 1)));
}
