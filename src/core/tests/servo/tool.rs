//! Tests of a tool with an offset from the tool frame, and a change of the tool while the arm moves.

use crate::reference::{pose, puma};
use crate::rig::Rig;
use dq_algebra::UnitDualQuaternion;
use dq_core::servo::{Arms, BeyondReach, PositionLimits, Reason, Revocation, State};
use dq_kinematics::control::Law;
use nalgebra::{UnitQuaternion, Vector3};

fn gripper() -> UnitDualQuaternion {
    let rotation = UnitQuaternion::from_scaled_axis(Vector3::new(0.4, -0.3, 0.8));
    UnitDualQuaternion::from_parts(rotation, Vector3::new(0.03, -0.02, 0.15))
}

fn apart(one: &UnitDualQuaternion, other: &UnitDualQuaternion) -> f64 {
    (one.inverse() * *other).screw_log().norm().min((one.inverse() * -*other).screw_log().norm())
}

#[test]
fn the_tool_s_offset_goes_to_the_goal() {
    for law in [Law::Logc, Law::Diffc, Law::DoubleGeodesic] {
        let mut rig = Rig::with(|settings| {
            settings.tool_offset = gripper();
            settings.controller.law = law;
        });
        rig.goal_pose(&(pose("theta_desired") * gripper()));
        rig.run_until(State::Settled, 30.0);
        rig.run(5.0);
        let at = puma().forward_kinematics(&rig.positions()).unwrap();
        assert!(apart(&at, &pose("theta_desired")) < 1.1e-2, "{law}: {at:?}");
        let pose = rig.servo.pose().unwrap();
        assert!(apart(&pose, &(at * gripper())) < 1e-3, "what is reported is the tool's");
    }
}

/// In every cycle the rig checks the command against the limits.
#[test]
fn another_tool_stands_until_somebody_asks_it_to_move() {
    let mut rig = Rig::new();
    // A change of the tool changes the speed of the tool point at once.
    rig.check_tools = false;
    rig.goal("theta_desired");
    rig.run(0.7);
    assert!(rig.speed() > 0.5);
    let (before, count) = (rig.command.clone(), rig.servo.status().goal_count);
    rig.change(|settings| settings.tool_offset = gripper());
    rig.cycle();
    let limit = rig.servo.settings().limits.joint_acceleration[0] * crate::rig::PERIOD.as_secs_f64();
    for (now, before) in rig.command.iter().zip(&before) {
        assert!((now - before).abs() <= limit * 1.000_001, "{now} after {before}");
    }
    rig.run(1.0);
    assert_eq!((rig.state(), rig.speed()), (State::Holding, 0.0));
    rig.pause(false);
    rig.cycle();
    let status = rig.servo.status();
    assert_eq!((status.goal_count, status.figures.elapsed), (count + 1, 0.0), "another motion");
    rig.run_until(State::Settled, 30.0);
    let at = puma().forward_kinematics(&rig.positions()).unwrap();
    assert!(apart(&(at * gripper()), &pose("theta_desired")) < 1.1e-2);
    // The path length does not include the jump from one tool to the other.
    assert!(rig.servo.status().figures.path_length < 2.0);
    // An arm that has arrived stays settled with its new tool.
    rig.change(|settings| settings.tool_offset = UnitDualQuaternion::identity());
    rig.run(1.0);
    assert_eq!((rig.state(), rig.speed()), (State::Holding, 0.0));
    assert_eq!(rig.servo.status().reason, Some(Reason::Revoked(Revocation::AnotherTool)));
    rig.goal("theta_desired");
    rig.run_until(State::Settled, 30.0);
    assert!(apart(&rig.servo.pose().unwrap(), &pose("theta_desired")) < 1.1e-2);
}

#[test]
fn no_offset_changes_no_bit() {
    let run = |offset: Option<UnitDualQuaternion>| {
        let mut rig = Rig::new();
        if let Some(offset) = offset {
            rig.change(|settings| settings.tool_offset = offset);
            rig.change(|settings| settings.tool_offset = UnitDualQuaternion::identity());
        }
        rig.goal("theta_desired");
        rig.run(1.0);
        rig.command.iter().map(|speed| speed.to_bits()).collect::<Vec<_>>()
    };
    assert_eq!(run(None), run(Some(gripper())));
}

#[test]
fn a_twist_in_the_tool_frame_keeps_that_frame_s_axes_and_moves_the_tool_s_point() {
    let mut rig = Rig::with(|settings| settings.tool_offset = gripper());
    rig.check_tools = false;
    rig.run(0.05);
    let arm = |rig: &Rig| puma().forward_kinematics(&rig.positions()).unwrap();
    let (before, frame) = (arm(&rig) * gripper(), arm(&rig).rotation());
    for _ in 0..100 {
        rig.twist([0.05, 0.0, 0.0], [0.0; 3], "tool0").unwrap();
        rig.cycle();
    }
    let moved = (arm(&rig) * gripper()).translation() - before.translation();
    let along = moved.dot(&(frame * Vector3::x()));
    assert!(along > 0.007 && (moved.norm() - along).abs() < 1e-5, "{moved:?}");
}

#[test]
fn both_tools_of_two_arms_have_the_offset() {
    let mut rig = Rig::two_arms();
    rig.change(|settings| settings.tool_offset = gripper());
    rig.run(0.01);
    let arms =
        rig.plants.iter().map(|plant| puma().forward_kinematics(plant.positions()).unwrap() * gripper());
    let [left, right] = arms.collect::<Vec<_>>().try_into().unwrap();
    assert!(apart(&rig.servo.pose().unwrap(), &(left.inverse() * right)) < 1e-9);
    let reach = Arms::one(puma()).reach(&Vector3::zeros(), PositionLimits::none(6).ranges()).longest;
    let mut longer = Arms::one(puma());
    longer.set_tool_offset(&gripper());
    let longer = longer.reach(&Vector3::zeros(), PositionLimits::none(6).ranges()).longest;
    assert!((longer - reach - gripper().translation().norm()).abs() < 1e-12);
}

#[test]
fn a_longer_tool_may_reach_a_goal_that_was_beyond_reach() {
    let mut rig = Rig::with(|settings| settings.beyond_reach = BeyondReach::Approach);
    let long = UnitDualQuaternion::from_parts(UnitQuaternion::identity(), Vector3::z());
    rig.check_tools = false;
    rig.take_point([1.5, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0], "").unwrap();
    rig.cycle();
    assert!(rig.servo.status().goal_beyond_reach);
    rig.change(|settings| settings.tool_offset = long);
    rig.cycle();
    assert!(!rig.servo.status().goal_beyond_reach);
    rig.change(|settings| settings.tool_offset = UnitDualQuaternion::identity());
    rig.cycle();
    assert!(rig.servo.status().goal_beyond_reach);
}
