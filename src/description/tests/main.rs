//! Tests of arms in robot descriptions, and of descriptions without an arm.

mod guess;
#[path = "../../kinematics/tests/jacobians.rs"]
mod jacobians;
mod mimic;
#[path = "../../algebra/tests/tolerance.rs"]
#[allow(dead_code)] // The tolerance of printed numbers is for others.
mod tolerance;

use dq_algebra::UnitDualQuaternion;
use dq_config::ForArm;
use dq_description::{DescribedArm, Description, Motion};
use dq_kinematics::arm::{ArmState, Chain, JointKind};
use jacobians::check_jacobians;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use proptest::prelude::*;
use std::process::{Command, Output};
use tolerance::ALGEBRA;

/// Tolerance for comparisons with an independent implementation.
const ORACLE: f64 = 1e-10;

fn text(name: &str) -> String {
    std::fs::read_to_string(file(name)).unwrap()
}

fn file(name: &str) -> String {
    format!("{}/../../tests/data/urdf/{name}.urdf", env!("CARGO_MANIFEST_DIR"))
}

fn puma() -> Chain {
    Chain::for_arm("puma560").unwrap()
}

fn done(output: Output, what: &str) -> Vec<u8> {
    assert!(output.status.success(), "{what}: {}", String::from_utf8_lossy(&output.stderr));
    output.stdout
}

/// The Python interpreter with Pinocchio, which tests/install.sh installs.
const PYTHON: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../target/venv/bin/python");

/// A sequence of numbers.
struct Numbers(std::vec::IntoIter<f64>);

impl Numbers {
    fn take<const N: usize>(&mut self) -> [f64; N] {
        std::array::from_fn(|_| self.0.next().unwrap())
    }

    fn list(&mut self, count: usize) -> Vec<f64> {
        (0..count).map(|_| self.0.next().unwrap()).collect()
    }
}

/// Compares poses and Jacobians at 1000 random configurations with Pinocchio's results.
fn check_against_pinocchio(document: &str, base: &str, tool: &str, kinds: &[JointKind]) {
    const COUNT: usize = 1000;
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/pin.py");
    let description = Description::read(&std::fs::read_to_string(document).unwrap(), base, tool).unwrap();
    let joints = description.arm.moving().map(|joint| joint.name.as_str());
    let count = COUNT.to_string();
    let arguments = [script, document, base, tool, &count].into_iter().chain(joints);
    let bytes = done(Command::new(PYTHON).args(arguments).output().unwrap(), document);
    let numbers = bytes.chunks_exact(8).map(|eight| f64::from_le_bytes(eight.try_into().unwrap()));
    let mut numbers = Numbers(numbers.collect::<Vec<_>>().into_iter());
    let chain = description.arm.chain().unwrap();
    assert_eq!(chain.kinds(), kinds);
    let mut state = ArmState::new(&chain);
    for _ in 0..COUNT {
        let positions = numbers.list(kinds.len());
        let pose: [f64; 16] = numbers.take();
        let jacobian = numbers.list(6 * kinds.len());
        chain.evaluate(&positions, &mut state).unwrap();
        let rotation = Matrix3::from_fn(|row, column| pose[4 * row + column]);
        let ours = state.base_from_tool().rotation().to_rotation_matrix();
        assert!((ours.matrix() - rotation).norm() < ORACLE, "{document} at {positions:?}");
        let point = Vector3::new(pose[3], pose[7], pose[11]);
        assert!(
            (state.base_from_tool().translation() - point).norm() < ORACLE,
            "{document} at {positions:?}"
        );
        for (joint, (angular, linear)) in state.tool_motions().enumerate() {
            let column = |row: usize| jacobian[row * kinds.len() + joint];
            let (l, w) = (Vector3::from_fn(|i, _| column(i)), Vector3::from_fn(|i, _| column(3 + i)));
            assert!(
                (linear - l).norm() < ORACLE && (angular - w).norm() < ORACLE,
                "joint {joint} at {positions:?}"
            );
        }
    }
    assert_eq!(numbers.0.len(), 0);
}

fn names(prefix: &str, count: usize) -> Vec<String> {
    (1..=count).map(|i| format!("{prefix}{i}")).collect()
}

fn describe(chain: &Chain) -> DescribedArm {
    let [joints, links] = ["joint", "link"].map(|prefix| names(prefix, chain.joint_count()));
    DescribedArm::of_chain(chain, "arm", &joints, ["base_link", "tool0"], &links).unwrap()
}

#[test]
fn pinocchio_agrees_on_the_ur5_the_panda_the_tiago_and_the_puma() {
    use JointKind::{Prismatic, Revolute};
    check_against_pinocchio(&file("ur5"), "base_link", "tool0", &[Revolute; 6]);
    check_against_pinocchio(&file("panda"), "panda_link0", "panda_link8", &[Revolute; 7]);
    let mut tiago = [Revolute; 8];
    tiago[0] = Prismatic;
    check_against_pinocchio(&file("tiago"), "base_link", "arm_tool_link", &tiago);
    let folder = tempfile::tempdir().unwrap();
    let document = folder.path().join("puma560.urdf");
    std::fs::write(&document, describe(&puma()).drawn_urdf()).unwrap();
    check_against_pinocchio(document.to_str().unwrap(), "base_link", "tool0", &[Revolute; 6]);
}

/// An arm of a revolute joint about x, a prismatic joint along a slanted axis, a continuous joint about −z, and a tool.
const GANTRY: &str = include_str!("../../../tests/data/urdf/gantry.urdf");

fn gantry() -> Chain {
    Description::read(GANTRY, "a", "e").unwrap().arm.chain().unwrap()
}

#[test]
fn any_axis_is_accepted_and_a_written_description_is_read_back_exactly() {
    let description = Description::read(GANTRY, "a", "e").unwrap();
    let [turn, slide, shift] = [0.7, 0.3, -1.1];
    let pose = gantry().forward_kinematics(&[turn, slide, shift]).unwrap();
    let frame = |x, y, z, rotation: UnitQuaternion<f64>| {
        UnitDualQuaternion::from_parts(rotation, Vector3::new(x, y, z))
    };
    let rpy = |roll, pitch, yaw| {
        UnitQuaternion::from_rotation_matrix(&Rotation3::from_euler_angles(roll, pitch, yaw))
    };
    let about = |axis: Vector3<f64>| UnitQuaternion::from_scaled_axis(axis);
    let expected = frame(0.1, 0.2, 0.3, rpy(0.4, 0.5, 0.6) * about(Vector3::new(turn, 0.0, 0.0)))
        * frame(slide / 3.0, slide * 2.0 / 3.0, -slide * 2.0 / 3.0, UnitQuaternion::identity())
        * frame(0.0, 0.0, 0.0, about(Vector3::new(0.0, 0.0, -shift)))
        * frame(0.0, 0.5, 0.0, rpy(0.0, 1.57, 0.0));
    assert!((pose.translation() - expected.translation()).norm() < ALGEBRA);
    assert!(pose.rotation().angle_to(&expected.rotation()) < 1e-7);
    let names: Vec<_> = description.arm.moving().map(|joint| joint.name.as_str()).collect();
    assert_eq!(names, ["j1", "j2", "j3"]);
    assert_eq!(description.beside.len(), 1);
    for (document, base, tool) in [
        (GANTRY.to_owned(), "a", "e"),
        (text("ur5"), "world", "tool0"),
        (text("tiago"), "base_link", "arm_tool_link"),
    ] {
        let read = Description::read(&document, base, tool).unwrap();
        let again = Description::read(&read.arm.urdf(), base, tool).unwrap();
        assert_eq!((&again.arm, again.beside.len()), (&read.arm, 0));
    }
}

#[test]
fn the_description_of_a_chain_is_that_chain() {
    let puma = (puma(), vec![0.3, -1.2, 0.7, 2.0, -0.4, 1.1]);
    for (chain, theta) in [puma, (gantry(), vec![0.7, 0.3, -1.1])] {
        let described = describe(&chain);
        for text in [described.urdf(), described.drawn_urdf()] {
            let read = Description::read(&text, "base_link", "tool0").unwrap().arm;
            // URDF does not allow a prismatic joint without limits.
            assert!(read == described || chain.kinds().contains(&JointKind::Prismatic), "{read:?}");
            let read = read.chain().unwrap();
            assert_eq!(read.kinds(), chain.kinds());
            let [one, other] = [&chain, &read].map(|chain| chain.forward_kinematics(&theta).unwrap());
            assert!((one.translation() - other.translation()).norm() < ALGEBRA);
            assert!(one.rotation().angle_to(&other.rotation()) < 1e-7);
        }
    }
    let (joints, links) = (names("joint", 3), names("link", 3));
    let error = |joints: &[String], links: &[String]| {
        let frames = ["a", "e"];
        DescribedArm::of_chain(&gantry(), "g", joints, frames, links).unwrap_err().to_string()
    };
    assert_eq!(error(&joints[..2], &links), "got 2 joint names, expected 3: the arm has 3 joints");
    assert_eq!(error(&joints, &names("link", 6)), "got 6 link names, expected 3: the arm has 3 joints");
}

proptest! {
    #[test]
    fn jacobians_with_a_prismatic_joint_agree_with_finite_differences(theta in prop::array::uniform3(-2.0..2.0f64)) {
        let chain = gantry();
        let point = chain.forward_kinematics(&theta).unwrap().translation();
        prop_assert!(point.norm() <= chain.reach([(-2.0, 2.0); 3].into_iter()));
        check_jacobians(&chain, &theta);
    }
}

/// The reader ignores `mimic` on a fixed joint.
#[test]
fn a_fixed_joint_that_mimics_is_accepted() {
    let fixed = "<joint name='j4' type='fixed'>";
    let mimicking = GANTRY.replace(fixed, &format!("{fixed}<mimic joint='j2'/>"));
    let read = |text: &str| Description::read(text, "a", "e").unwrap().arm;
    assert_eq!(read(&mimicking), read(GANTRY));
}

#[test]
fn a_description_without_an_arm_is_rejected_in_one_line_that_names_the_element() {
    let with = |from: &str, to: &str| GANTRY.replacen(from, to, 1);
    let nested = format!("<robot>{}{}</robot>", "<a>".repeat(50_000), "</a>".repeat(50_000));
    let cases: Vec<(String, &[&str])> = vec![
        (with("type='revolute'", "type='floating'"), &["joint \"j1\"", "floating"]),
        (with("type='prismatic'", "type='planar'"), &["joint \"j2\"", "planar"]),
        (
            with("<parent link='d'/><child link='f'/>", "<parent link='e'/><child link='a'/>"),
            &["joint \"", "expected links that form a tree, no ring"],
        ),
        (
            with("<parent link='d'/><child link='f'/>", "<parent link='f'/><child link='f'/>"),
            &["joint \"finger\"", "its child \"f\" carries its parent \"f\" too", "no ring"],
        ),
        (with("lower='-1'", "lower='low'"), &["joint \"j1\"", "lower of its limit is \"low\""]),
        (with("xyz='0.1 0.2 0.3'", "xyz='0.1 0.2'"), &["joint \"j1\"", "xyz of its origin", "three numbers"]),
        (with("xyz='0.1 0.2 0.3'", "xyz='nan 0 0'"), &["joint \"j1\"", "three numbers"]),
        (with("xyz='0.1 0.2 0.3'", "xyz='9e9 0 0'"), &["joint \"j1\"", "three numbers"]),
        (with("xyz='0.1 0.2 0.3'", "xyz='1e4 0 0'"), &["origin of joint 1", "1000"]),
        (with("xyz='1 2 -2'", "xyz='0 0 0'"), &["joint \"j2\"", "axis", "direction"]),
        (with("rpy='0.4 0.5 0.6'", "quat_xyzw='0 0 0 1'"), &["joint \"j1\"", "quat_xyzw"]),
        (with("<link name='f'/>", "<link name='f'/><link name='g'/>"), &["the roots \"a\" and \"g\""]),
        (with("<link name='f'/>", ""), &["joint \"finger\"", "child \"f\" is no link"]),
        (with("<parent link='d'/>", ""), &["joint \"j4\"", "<parent link=...>"]),
        (
            with("<child link='f'/>", "<child link='e'/>"),
            &["joint \"finger\"", "child \"e\" is the child of joint \"j4\" too"],
        ),
        (with("name='j2'", "name='j1'"), &["joint \"j1\"", "twice"]),
        (with("name='j2'", "name='&#127;'"), &["joint", "printable"]),
        (with("name='j2' ", ""), &["joint \"\"", "no name, in line 4"]),
        (
            with("<link name='a'/>", "<xacro:macro name='m' xmlns:xacro='http://www.ros.org/wiki/xacro'/>"),
            &["xacro:macro", "line 1"],
        ),
        (with("<link name='a'/>", "\n<xacro:arm/>"), &["<xacro:arm> in line 2", "expand it first"]),
        (with("xyz='1 2 -2'", "xyz='${x} 0 1'"), &["joint \"j2\"", "${x}"]),
        (with("</robot>", ""), &["no XML"]),
        ("<sdf/>".to_owned(), &["<sdf>", "<robot>"]),
        ("joints: [a]".to_owned(), &["no XML"]),
        (String::new(), &["no XML"]),
        ("<!DOCTYPE r [<!ENTITY a 'aa'>]><robot/>".to_owned(), &["defines no link", "macro file"]),
        (" ".repeat(5 << 20), &["5242880 bytes", "4194304"]),
        (format!("<robot>{}</robot>", "<a/>".repeat(300_000)), &["no XML"]),
        (nested, &["defines no link"]),
        (with("name='f'", &format!("name='{}'", "f".repeat(300))), &["250 bytes"]),
    ];
    for (document, needles) in cases {
        let message =
            Description::read(&document, "a", "e").and_then(|read| read.arm.chain()).unwrap_err().to_string();
        let whole = needles.iter().all(|needle| message.contains(needle));
        assert!(whole && !message.contains('\n') && message.len() < 900, "{needles:?}: {message}");
    }
    let message = |base, tool| Description::read(GANTRY, base, tool).unwrap_err().to_string();
    assert!(
        message("a", "z")
            .contains("tool_frame is \"z\", no link of the robot description, which has a, b, c, d, e, f")
    );
    assert!(message("e", "a").contains("no joints lead from base_frame \"e\" to tool_frame \"a\""));
    assert!(message("f", "e").contains("hangs from \"a\""));
    assert!(
        message("d", "e").contains("no joint that moves is between base_frame \"d\" and tool_frame \"e\"")
    );
    assert!(message("a", "a").contains("no joint that moves"));
}

#[test]
fn joints_outside_of_the_chain_may_be_invalid() {
    let broken = GANTRY.replace("<mimic joint='j2'/>", "<axis xyz='none'/><limit lower='x'/>");
    let read = Description::read(&broken, "a", "e").unwrap();
    let [stiff] = read.beside.as_slice() else { panic!("{:?}", read.beside) };
    assert_eq!((read.arm.joints.len(), stiff.motion), (4, Motion::Fixed));
    let free = GANTRY.replace("name='finger' type='prismatic'", "name='finger' type='floating'");
    assert!(Description::read(&free, "a", "e").unwrap().beside.is_empty());
}
