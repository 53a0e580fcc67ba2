//! Tests of tasks that leave part of the tool's pose free, such as `position`. Under such a task, an arm with fewer than six joints
//! can reach goals. The tests also check how an arm moves in the free part.

use crate::aims::{LESS, missed, turned};
use crate::reference::puma;
use crate::rig::Rig;
use dq_config::ServoParameters;
use dq_core::servo::{Posture, Stall, State};
use dq_kinematics::arm::{Chain, Convention, DhRow};
use dq_kinematics::control::{Aim, Law};
use nalgebra::Vector3;
use std::f64::consts::FRAC_PI_2;

fn rows() -> [DhRow; 5] {
    let rows =
        [(FRAC_PI_2, 0.0, 0.3), (0.0, 0.4, 0.0), (0.0, 0.35, 0.0), (FRAC_PI_2, 0.0, 0.0), (0.0, 0.0, 0.1)];
    rows.map(|(alpha, a, d)| DhRow { alpha, a, d, theta_offset: 0.0 })
}

/// Returns an arm of a waist, a shoulder and an elbow.
fn three_joints() -> Chain {
    Chain::new(Convention::StandardDh, &rows()[..3]).unwrap()
}

/// Returns the arm of [`three_joints`] with a wrist joint that pitches and a wrist joint that rolls. Its tool can point only
/// within the vertical plane of its links.
fn five_joints() -> Chain {
    Chain::new(Convention::StandardDh, &rows()).unwrap()
}

/// Returns the URDF of an arm. `joints` has the axis of each joint and the origin of its frame in the previous link, base first.
fn urdf(joints: &[(&str, &str)]) -> String {
    let mut text = "<robot name=\"arm\"><link name=\"link0\"/>".to_owned();
    for (i, (axis, origin)) in joints.iter().enumerate() {
        let next = i + 1;
        text += &format!(
            "<link name=\"link{next}\"/><joint name=\"joint{next}\" type=\"revolute\"><parent link=\"link{i}\"/>\
             <child link=\"link{next}\"/><origin xyz=\"{origin}\"/><axis xyz=\"{axis}\"/>\
             <limit lower=\"-2.8\" upper=\"2.8\" velocity=\"2\" effort=\"1\"/></joint>"
        );
    }
    let count = joints.len();
    text + &format!(
        "<link name=\"tool\"/><joint name=\"flange\" type=\"fixed\"><parent link=\"link{count}\"/><child link=\"tool\"/>\
         <origin xyz=\"0.1 0 0\" rpy=\"0 1.5707963267948966 0\"/></joint></robot>"
    )
}

/// An arm with three parallel revolute joints and a prismatic joint. The z axis of its tool is vertical.
const SCARA: &str = include_str!("../../../tests/data/urdf/scara.urdf");

/// Returns an arm of a waist, a shoulder, an elbow, and a wrist that pitches and yaws. Its tool can point anywhere but cannot roll.
fn welder() -> String {
    urdf(&[
        ("0 0 1", "0 0 0.3"),
        ("0 1 0", "0 0 0"),
        ("0 1 0", "0.4 0 0"),
        ("0 1 0", "0.35 0 0"),
        ("0 0 1", "0.05 0 0"),
    ])
}

/// A rig, and the chain of its arm.
type Arm = (Rig, Chain);

fn with_rows(chain: Chain, start: &[f64]) -> Arm {
    (Rig::of_arm(chain.clone(), start.to_vec()), chain)
}

fn described(description: &str, start: Vec<f64>) -> Arm {
    let parameters = ServoParameters::from_urdf(description, "link0", "tool").unwrap();
    let chain = parameters.arms.chain().clone();
    (Rig::of(parameters, start), chain)
}

/// Moves the arm to a goal and back to its start pose, and checks that it arrives at both. The goal is the tool's pose after each joint
/// has moved by its number in `by` \[rad, prismatic: m\]. Both poses are also rotated in a way that the task `aim` leaves free. So the
/// joints may end at other positions.
fn there_and_back((mut rig, chain): Arm, aim: Aim, law: Law, by: &[f64]) {
    rig.change(|settings| (settings.controller.aim, settings.controller.law) = (aim, law));
    let start = rig.positions();
    let there: Vec<_> = start.iter().zip(by).map(|(position, by)| position + by).collect();
    let free = match aim {
        Aim::Pose => Vector3::zeros(),
        Aim::Position => Vector3::new(0.9, -1.2, 0.4),
        Aim::PositionAndAxis => Vector3::new(0.0, 0.0, 1.3),
        Aim::Orientation | Aim::Distance => unreachable!("not tried here"),
    };
    rig.run(0.1);
    for joints in [&there, &start] {
        let goal = turned(&chain.forward_kinematics(joints).unwrap(), free);
        rig.goal_pose(&goal);
        rig.run_until(State::Tracking, 1.0);
        rig.run_until(State::Settled, 30.0);
        let tool = chain.forward_kinematics(rig.plants[0].positions()).unwrap();
        let (way, angle) = missed(aim, &tool, &goal);
        assert!(way < 1e-3 && angle < 1e-2, "{aim} {law}: {way} m, {angle} rad");
        // The status shows only the errors that the task controls.
        let status = rig.servo.status();
        let (angular, linear) =
            (status.pose_error.fixed_rows::<3>(0).norm(), status.pose_error.fixed_rows::<3>(3).norm());
        assert!(linear < 2e-3 && angular < 2e-2, "{aim} {law}: {}", status.pose_error);
        assert!(status.figures.rotation_error < 1e-2 && status.figures.arrival_time.is_some());
    }
}

#[test]
fn three_joints_go_to_positions_under_each_law() {
    for law in Law::ALL {
        let arm = with_rows(three_joints(), &[0.2, 0.8, -1.4]);
        there_and_back(arm, Aim::Position, law, &[0.5, -0.3, 0.4]);
    }
    let described = described(
        &urdf(&[("0 0 1", "0 0 0.3"), ("0 1 0", "0 0 0"), ("0 1 0", "0.4 0 0")]),
        vec![0.2, -0.8, 1.4],
    );
    there_and_back(described, Aim::Position, Law::Logc, &[0.5, -0.3, 0.4]);
}

#[test]
fn four_joints_of_a_scara_go_to_positions_and_upright() {
    for aim in LESS {
        there_and_back(described(SCARA, vec![0.2, 0.9, -0.4, -0.1]), aim, Law::Logc, &[0.5, 0.3, 0.2, -0.12]);
    }
}

#[test]
fn five_joints_go_to_positions_and_axes() {
    for aim in LESS {
        for law in [Law::Logc, Law::DoubleGeodesic, Law::Diffc, Law::LogcTranspose] {
            let by = [0.4, -0.3, 0.4, 0.3, 0.3];
            there_and_back(described(&welder(), vec![0.2, -0.8, 1.4, 0.5, 0.4]), aim, law, &by);
        }
        let arm = with_rows(five_joints(), &[0.2, 0.8, -1.4, 1.0, 0.4]);
        there_and_back(arm, aim, Law::Logc, &[0.4, -0.3, 0.4, 0.3, 0.3]);
    }
}

#[test]
fn six_joints_go_to_positions_and_axes_too() {
    for aim in [Aim::Pose, Aim::Position, Aim::PositionAndAxis] {
        there_and_back((Rig::new(), puma()), aim, Law::Logc, &[0.2, 0.3, -0.3, 0.3, 0.2, 0.4]);
    }
}

/// The arm cannot turn its tool axis out of the vertical plane of its links, as this goal demands. So the arm stalls if the task
/// includes the axis, and arrives if the task is the position alone.
#[test]
fn what_the_arm_cannot_do_is_asked_for_or_not() {
    let chain = five_joints();
    let start = vec![0.2, 0.8, -1.4, 1.0, 0.4];
    let goal = turned(&chain.forward_kinematics(&start).unwrap(), Vector3::new(0.5, 0.3, 0.0));
    for aim in LESS {
        let mut rig = Rig::of_arm(chain.clone(), start.clone());
        rig.change(|settings| settings.controller.aim = aim);
        rig.run(0.1);
        rig.goal_pose(&goal);
        if aim == Aim::Position {
            rig.run_until(State::Settled, 1.0);
            assert_eq!(rig.servo.status().figures.rotation_error, 0.0);
        } else {
            rig.run_until(State::Stalled, 40.0);
            assert!(
                matches!(rig.servo.status().stall, Some(Stall::Unreachable)),
                "{:?}",
                rig.servo.status().stall
            );
        }
    }
}

#[test]
fn what_the_task_frees_goes_to_the_posture() {
    let mut rig = Rig::new();
    let start = rig.positions();
    let mut posture = start.clone();
    posture[3] += 0.5;
    posture[4] += 0.4;
    posture[5] -= 0.6;
    let goal = puma().forward_kinematics(&start).unwrap();
    rig.change(|settings| {
        settings.controller.aim = Aim::Position;
        settings.posture = Posture { positions: posture.clone(), gain: 1.0 };
    });
    rig.run(0.1);
    rig.goal_pose(&goal);
    rig.run_until(State::Settled, 1.0);
    for _ in 0..20 {
        rig.run(0.5);
        // The arm stays settled, whatever the tool's orientation.
        assert_eq!(rig.state(), State::Settled);
    }
    let tool = puma().forward_kinematics(rig.plants[0].positions()).unwrap();
    assert!((tool.translation() - goal.translation()).norm() < 1e-3);
    assert!(tool.rotation().angle_to(&goal.rotation()) > 0.3);
    let positions = rig.positions();
    let wrist = positions[3..].iter().zip(&posture[3..]).map(|(one, other)| (one - other).abs());
    assert!(wrist.sum::<f64>() < 0.05, "{positions:?} {posture:?}");
}

/// A twist moves the tool only in the components that the task controls.
#[test]
fn a_twist_moves_what_the_task_asks_for() {
    let chain = three_joints();
    let mut rig = Rig::of_arm(chain.clone(), vec![0.2, 0.8, -1.4]);
    rig.change(|settings| settings.controller.aim = Aim::Position);
    rig.run(0.1);
    let before = chain.forward_kinematics(&rig.positions()).unwrap().translation();
    for _ in 0..500 {
        rig.twist([0.05, 0.0, 0.02], [0.0, 0.7, 0.0], "").unwrap();
        rig.cycle();
    }
    let way = chain.forward_kinematics(&rig.positions()).unwrap().translation() - before;
    let expected = Vector3::new(0.05, 0.0, 0.02);
    assert!((way - expected).norm() < 2e-3, "{way} {expected}");
}
