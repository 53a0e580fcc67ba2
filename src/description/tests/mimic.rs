//! Tests of chains with mimic joints: palletizers, linkages, telescopes.

use super::{check_against_pinocchio, file, text};
use crate::jacobians::check_jacobians;
use dq_algebra::UnitDualQuaternion;
use dq_description::{DescribedArm, Description, Motion};
use dq_kinematics::arm::JointKind::{self, Prismatic, Revolute};
use proptest::prelude::*;

/// The robots: the file, the tool, the joint names, and the joint kinds.
const ROBOTS: [(&str, &str, &[&str], &[JointKind]); 5] = [
    ("palletizer", "tool0", &["turret", "arm", "lever", "flange"], &[Revolute; 4]),
    ("desktop", "end", &["waist", "upper", "lower", "end"], &[Revolute; 4]),
    ("telescope", "pitch", &["stage_1", "roll", "pitch"], &[Prismatic, Revolute, Revolute]),
    ("scissor", "plate", &["swivel", "bar_4", "plate"], &[Revolute, Revolute, Prismatic]),
    ("screw", "bend_3", &["nut", "bend_2"], &[Prismatic, Revolute]),
];

fn read(robot: &str, tool: &str) -> DescribedArm {
    Description::read(&text(&format!("mimic/{robot}")), "base_link", tool).unwrap().arm
}

#[test]
fn pinocchio_agrees_on_arms_with_mimic_joints() {
    for (robot, tool, joints, kinds) in ROBOTS {
        let arm = read(robot, tool);
        let names: Vec<_> = arm.moving().filter_map(|joint| joint.name.strip_suffix("_joint")).collect();
        assert_eq!(names, joints, "{robot}");
        check_against_pinocchio(&file(&format!("mimic/{robot}")), "base_link", tool, kinds);
    }
}

proptest! {
    #[test]
    fn jacobians_with_mimic_joints_agree_with_finite_differences(theta in prop::array::uniform4(-1.0..1.0f64)) {
        for (robot, tool, joints, _) in ROBOTS {
            let (chain, theta) = (read(robot, tool).chain().unwrap(), &theta[..joints.len()]);
            check_jacobians(&chain, theta);
            let point = chain.forward_kinematics(theta).unwrap().translation();
            let ranges = [(-1.0, 1.0); 4];
            prop_assert!(point.norm() <= chain.reach(ranges.into_iter()), "{}", robot);
            let (gap, reach) = chain.gap(&point, ranges.into_iter());
            prop_assert!(gap <= reach, "{}", robot);
        }
    }
}

/// The chain gives the same link frames as a computation joint by joint.
#[test]
fn the_places_of_links_include_those_that_mimic_joints_move() {
    for (robot, tool, joints, _) in ROBOTS {
        let description = Description::read(&text(&format!("mimic/{robot}")), "base_link", tool).unwrap();
        let (chain, theta) = (description.arm.chain().unwrap(), &[0.3, -0.2, 0.5, 0.1][..joints.len()]);
        let (links, places) = (chain.link_poses(theta).unwrap(), description.places(&chain).unwrap());
        assert_eq!(links.len(), chain.link_count());
        let mut base_from_link = UnitDualQuaternion::identity();
        for joint in &description.arm.joints {
            let coupling = description.arm.coupling(joint);
            let position = coupling.map_or(0.0, |coupling| coupling.at(theta[coupling.driver]));
            base_from_link *= joint.parent_from_child(position);
            let place = places[joint.child.as_str()];
            let difference = (links[place.carrier - 1] * place.carrier_from_link).inverse() * base_from_link;
            assert!(difference.translation().norm() < 1e-12, "{robot} {}", joint.child);
            assert!(difference.rotation().angle() < 1e-7, "{robot} {}", joint.child);
        }
    }
}

#[test]
fn a_written_description_with_mimic_joints_is_read_back_exactly() {
    for (robot, tool, ..) in ROBOTS {
        let arm = read(robot, tool);
        assert_eq!(Description::read(&arm.urdf(), "base_link", tool).unwrap().arm, arm);
    }
}

/// Returns the motion of the joint `name`, and its limits: lower, upper and speed.
fn limits(arm: &DescribedArm, name: &str) -> (Motion, [f64; 3]) {
    let joint = arm.moving().find(|joint| joint.name == format!("{name}_joint")).unwrap();
    let numbers = [joint.limits.lower, joint.limits.upper, joint.limits.velocity];
    (joint.motion, numbers.map(|number| number.map_or(f64::NAN, |number| (number * 1e9).round() / 1e9)))
}

#[test]
fn limits_of_mimic_joints_bind_their_drivers() {
    let (palletizer, desktop) = (read("palletizer", "tool0"), read("desktop", "end"));
    // The elbow turns the other way. The forearm's range does not restrict the lever.
    assert_eq!(limits(&palletizer, "arm"), (Motion::Revolute, [-0.65, 1.4, 2.0]));
    assert_eq!(limits(&palletizer, "lever"), (Motion::Revolute, [-0.2, 2.0, 2.0]));
    assert_eq!(limits(&desktop, "lower"), (Motion::Revolute, [-0.2, 1.2, 1.5]));
    // The limit is half of the second stage's limit, plus 0.02 m. The speed is the second stage's speed, because both stages are
    // equally fast.
    assert_eq!(limits(&read("telescope", "pitch"), "stage_1"), (Motion::Prismatic, [0.0, 0.4, 0.2]));
    // Two bars turn twice as far and twice as fast.
    assert_eq!(limits(&read("scissor", "plate"), "bar_4"), (Motion::Revolute, [-1.2, 0.1, 1.0]));
    let screw = read("screw", "bend_3");
    assert_eq!(limits(&screw, "nut"), (Motion::Prismatic, [-0.465, 0.5, 0.25]));
    // A continuous joint gets the limits of the joints that it drives, with ratios of 0.5, 0.25 and 0.1. The speed of the
    // continuous joint itself was not limited.
    let (motion, [lower, upper, speed]) = limits(&screw, "bend_2");
    assert_eq!((motion, [lower, upper]), (Motion::Revolute, [-1.0, 1.0]));
    assert!(speed.is_nan());
}

#[test]
fn a_mimic_joint_without_a_driver_is_rejected_by_name() {
    let text = text("mimic/telescope");
    let driver = "<mimic joint=\"stage_1_joint\" multiplier=\"1\" offset=\"0\"/>";
    assert!(text.contains(driver));
    for (mimic, why) in [
        ("<mimic joint=\"none\"/>", "mimics \"none\", which is no joint that moves on an axis"),
        ("<mimic/>", "mimics \"\""),
        ("<mimic joint=\"stage_2_joint\"/>", "mimics itself"),
        ("<mimic joint=\"stage_3_joint\"/>", "mimics itself"),
        ("<mimic joint=\"stage_1_joint\" multiplier=\"x\"/>", "multiplier of its mimic is \"x\""),
        ("<mimic joint=\"stage_1_joint\" multiplier=\"0\"/>", "moves 0 times as much as \"stage_1_joint\""),
        ("<mimic joint=\"stage_1_joint\" offset=\"nan\"/>", "offset of its mimic is \"nan\""),
    ] {
        let refused = Description::read(&text.replace(driver, mimic), "base_link", "pitch").unwrap_err();
        let message = refused.to_string();
        assert!(message.contains("joint \"stage_2_joint\"") && message.contains(why), "{message}");
    }
    let fixed = text.replacen("prismatic", "fixed", 1);
    let refused = Description::read(&fixed, "base_link", "pitch").unwrap_err().to_string();
    assert!(refused.contains("mimics \"stage_1_joint\", which is no joint that moves"), "{refused}");
}
