//! Arms of more than six joints: what the tool leaves free goes to a posture, and never disturbs the tool.

use crate::arms::{servo, start};
use crate::rig::Rig;
use dq_config::{NodeParameters, ServoParameters};
use dq_core::servo::{Posture, State};
use dq_kinematics::arm::ArmState;
use dq_kinematics::control::Aim;
use dq_params::Value;
use proptest::prelude::*;

const ARM: &str = "panda";

proptest! {
    #[test]
    fn what_the_inverse_leaves_free_moves_the_arm_and_not_the_tool(
        theta in prop::array::uniform7(-1.5..1.5f64), wanted in prop::array::uniform7(-1.0..1.0f64)
    ) {
        let parameters = servo(ARM);
        let (chain, damping) = (parameters.arms.chain(), parameters.settings.controller.damping);
        let mut state = ArmState::new(chain);
        chain.evaluate(&theta, &mut state).unwrap();
        prop_assume!(state.smallest_singular_value() > damping.threshold);
        let mut free = wanted;
        damping.leave_tool(&state, Aim::Pose, &mut free);
        let (omega, v) = state.tool_twist(&free);
        prop_assert!(omega.norm() < 1e-11 && v.norm() < 1e-11, "{omega} {v}");
        // A projection: the second time takes nothing.
        let mut again = free;
        damping.leave_tool(&state, Aim::Pose, &mut again);
        let rest: f64 = free.iter().zip(&again).map(|(one, other)| (one - other).abs()).sum();
        prop_assert!(rest < 1e-11);
    }
}

/// How far the joints are from the posture after a motion and ten seconds more, when the arm had settled, and how far the tool strays in
/// the ten seconds \[m\].
fn moved(gain: f64) -> (f64, f64, f64) {
    let (mut parameters, start) = (servo(ARM), start(ARM));
    // One of the many postures that the goal allows.
    let turns = [0.5, -0.2, -0.5, 0.2, 0.3, 0.2, -0.3];
    let posture: Vec<_> = start.iter().zip(turns).map(|(angle, turn)| angle + turn).collect();
    parameters.settings.posture = Posture { positions: posture.clone(), gain };
    let chain = parameters.arms.chain().clone();
    let pose = chain.forward_kinematics(&posture).unwrap();
    let mut rig = Rig::of(parameters, start);
    rig.run(0.1);
    rig.goal_pose(&pose);
    rig.run_until(State::Tracking, 1.0);
    let begun = rig.now;
    rig.run_until(State::Settled, 30.0);
    let time = (rig.now - begun).as_secs_f64();
    rig.run(5.0);
    let mut astray: f64 = 0.0;
    for _ in 0..10 {
        rig.run(0.5);
        let tool = chain.forward_kinematics(rig.plants[0].positions()).unwrap();
        astray = astray.max((tool.translation() - pose.translation()).norm());
        assert_eq!(rig.state(), State::Settled);
    }
    let distance = rig.plants[0].positions().iter().zip(&posture).map(|(one, other)| (one - other).powi(2));
    (distance.sum::<f64>().sqrt(), time, astray)
}

#[test]
fn a_posture_is_gone_to_while_the_tool_stays() {
    let ((without, time_without, _), (with, time_with, astray)) = (moved(1e-9), moved(1.0));
    assert!(with < 0.02 && without > 0.1, "{with} {without}");
    assert!(astray < 1e-4, "{astray} m");
    assert!((time_with - time_without).abs() < 0.1 * time_without, "{time_with} s, without {time_without} s");
    // Far faster than the joints are allowed to go: every cycle is held against the limits.
    moved(10.0);
}

#[test]
fn a_posture_is_off_by_default_and_has_a_number_for_each_joint() {
    assert_eq!(servo(ARM).settings.posture, Posture::default());
    let (store, _) = ServoParameters::start("/dq_servo", crate::arms::given(ARM)).unwrap();
    let set = |positions: usize, gain: f64| {
        let changes = [
            ("posture.positions".to_owned(), Value::DoubleArray(vec![0.5; positions])),
            ("posture.gain".to_owned(), Value::Double(gain)),
        ];
        ServoParameters::from_store(&store.with(&changes).unwrap()).map(|all| all.settings.posture)
    };
    assert_eq!(set(7, 1.0).unwrap(), Posture { positions: vec![0.5; 7], gain: 1.0 });
    let why = set(6, 1.0).unwrap_err().to_string();
    assert!(why.contains("posture.positions") && why.contains("7 numbers"), "{why}");
}
