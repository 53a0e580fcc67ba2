//! Tests the built-in arms.

use crate::arm;
use dq_kinematics::control::SignMemory;
use dq_studies::compare::Arm;
use std::path::Path;

#[test]
fn the_arms_reach_where_their_makers_say() {
    // The positions of the tool with the arm stretched out or upright [m]: UR5e's zero pose; Panda's and iiwa's upright poses;
    // xArm's zero pose (207, 112 mm).
    let cases: [(&str, &[f64], [f64; 3]); 4] = [
        ("ur5e", &[0.0; 6], [-0.8172, -0.2329, 0.0628]),
        ("panda", &[0.0; 7], [0.088, 0.0, 0.333 + 0.316 + 0.384 - 0.107]),
        ("iiwa14", &[0.0; 7], [0.0, 0.0, 0.36 + 0.42 + 0.4 + 0.126]),
        ("xarm6", &[0.0; 6], [0.207, 0.0, 0.112]),
    ];
    for (name, theta, expected) in cases {
        let pose = arm(name).parameters.arms.chain().forward_kinematics(theta).unwrap();
        let off = (pose.translation() - nalgebra::Vector3::from(expected)).norm();
        // The manufacturers round to a hundredth of a millimeter.
        assert!(off < 2e-5, "{name}: {}", pose.translation());
    }
}

/// The distances of the xArm 6 from joint 2 to joint 3 are 53.5 mm and 284.5 mm.
#[test]
fn the_xarm_s_second_row_is_a_hypotenuse() {
    let text = include_str!("../../msg_config/arms/xarm6.yaml");
    let (a, offset) = (f64::hypot(0.0535, 0.2845), f64::atan2(0.2845, 0.0535));
    assert!(text.contains(&format!("a: [0.0, {a}, 0.0775")), "{a}");
    assert!(text.contains(&format!("theta_offset: [0.0, -{offset}, {offset}, 0.0")), "{offset}");
}

#[test]
fn tasks_are_between_the_position_limits_and_start_with_the_nearer_sign() {
    for arm in Arm::builtin().unwrap() {
        let limits = &arm.parameters.settings.limits.position;
        for number in 0..50 {
            let task = arm.task(7, number).unwrap();
            assert_eq!(task, arm.task(7, number).unwrap());
            assert_ne!(task, arm.task(8, number).unwrap());
            for (angle, (low, high)) in task.start.iter().zip(limits.lower.iter().zip(&limits.upper)) {
                assert!((*low..=*high).contains(angle), "{}: {angle}", arm.name);
            }
            let mut here = arm.parameters.arms.clone();
            here.evaluate(&task.start);
            assert_eq!(SignMemory::nearest(&task.base_from_goal, &here.pose()).sign(), 1.0);
        }
    }
}

#[test]
fn an_arm_from_a_file_is_that_arm_and_bad_files_get_one_line() {
    let read = |file: &str| Arm::named(&Path::new(env!("CARGO_MANIFEST_DIR")).join(file));
    let ur5e = read("msg_config/arms/ur5e.yaml").unwrap();
    assert_eq!((ur5e.name.as_str(), &ur5e.parameters), ("ur5e", &arm("ur5e").parameters));
    for (file, part) in [("nothing.yaml", "nothing.yaml"), ("Cargo.toml", "Cargo.toml")] {
        let message = read(file).unwrap_err().to_string();
        assert!(message.contains(part) && !message.contains('\n'), "{message}");
    }
}
