//! Tests of URDF 1.2: rotations as quaternions, capsules, and limits on acceleration, deceleration and jerk.

use crate::text;
use dq_config::{NodeParameters, ServoParameters};
use dq_description::Description;
use dq_params::{ParameterStore, Value};
use nalgebra::Vector3;

const ARM: &str = include_str!("../../../tests/data/cases/urdf/urdf_1_2.urdf");

fn start(urdf: &str, more: &[(&str, Value)]) -> (ParameterStore, Vec<String>) {
    let arm = [("robot_description", text(urdf)), ("base_frame", text("base")), ("tool_frame", text("l6"))];
    crate::start(&[&arm, more].concat()).unwrap()
}

fn numbers(store: &ParameterStore, name: &str) -> Vec<f64> {
    let Some(Value::DoubleArray(numbers)) = store.get(name) else { panic!("{:?}", store.get(name)) };
    numbers.clone()
}

fn with_rotation(rotation: &str) -> String {
    ARM.replace("quat_xyzw=\"0 0.7071068 0 0.7071068\"", rotation)
}

#[test]
fn a_quaternion_equals_the_rotation_by_angles() {
    let read = |text: &str| Description::read(text, "base", "l6").unwrap().arm.chain().unwrap();
    let place = |text: &str| read(text).forward_kinematics(&[0.1, 0.2, 0.3, 0.4, 0.5, 0.6]).unwrap();
    // (0, y, 0, w) is a rotation about y; its length does not matter. The other cases are two successive rotations, with matrices
    // from pin (4.1.0).
    let same = [
        ("quat_xyzw=\"0 0.7071068 0 0.7071068\"", "rpy=\"0 1.5707963267948966 0\""),
        ("quat_xyzw=\"0 2 0 2\"", "rpy=\"0 1.5707963267948966 0\""),
        ("quat_xyzw=\"0.5 0.5 0.5 0.5\"", "rpy=\"1.5707963267948966 0 1.5707963267948966\""),
        ("quat_xyzw=\"-0.5 0.5 0.5 0.5\"", "rpy=\"0 1.5707963267948966 1.5707963267948966\""),
    ];
    for (quaternion, angles) in same {
        let [one, other] = [quaternion, angles].map(|rotation| place(&with_rotation(rotation)));
        assert!((one.translation() - other.translation()).norm() < 1e-12, "{quaternion}");
        assert!((one.rotation() * Vector3::x() - other.rotation() * Vector3::x()).norm() < 1e-12);
    }
}

#[test]
fn an_invalid_quaternion_or_one_that_ros_2_ignores_is_rejected() {
    for (text, why) in [
        (with_rotation("rpy=\"0 0 0\" quat_xyzw=\"0 0 0 1\""), "is there beside rpy"),
        (with_rotation("quat_xyzw=\"0 0 0\""), "\"0 0 0\": expected a quaternion x y z w"),
        (with_rotation("quat_xyzw=\"0 0 0 0\""), "expected a quaternion x y z w"),
        (with_rotation("quat_xyzw=\"0 0 0 nan\""), "expected a quaternion x y z w"),
        (ARM.replace(" version=\"1.2\"", ""), "needs <robot version=\"1.2\">"),
    ] {
        let refused = Description::read(&text, "base", "l6").unwrap_err().to_string();
        assert!(refused.starts_with("joint \"j2\"") && refused.contains(why), "{refused}");
    }
}

#[test]
fn accelerations_decelerations_and_jerks_are_defaults() {
    let (store, warnings) = start(ARM, &[]);
    assert_eq!(warnings, Vec::<String>::new());
    assert_eq!(numbers(&store, "limits.joint_acceleration"), [10.0, 10.0, 10.0, 4.0, 4.0, 4.0]);
    // A missing deceleration equals the acceleration. A missing jerk is practically unlimited.
    assert_eq!(numbers(&store, "limits.joint_deceleration"), [5.0, 5.0, 5.0, 4.0, 4.0, 4.0]);
    assert_eq!(numbers(&store, "limits.jerk"), [50.0, 50.0, 50.0, 1e6, 1e6, 1e6]);
    assert!(ServoParameters::from_store(&store).is_ok());
    let own = Value::DoubleArray(vec![2.0; 6]);
    let (store, _) = start(ARM, &[("limits.joint_deceleration", own.clone())]);
    assert_eq!(numbers(&store, "limits.joint_deceleration"), [2.0; 6], "parameters come first");
    // If a parameter sets a larger acceleration, the jerk must still reach it in time.
    let (store, warnings) = start(ARM, &[("limits.joint_acceleration", Value::DoubleArray(vec![40.0; 6]))]);
    assert_eq!(numbers(&store, "limits.jerk")[0], 200.0);
    assert!(
        warnings[0].contains("joint \"j1\"") && ServoParameters::from_store(&store).is_ok(),
        "{warnings:?}"
    );
}

#[test]
fn a_stop_is_in_time_whatever_the_description_says() {
    for (limit, name, taken) in
        [("deceleration=\"5.0\"", "limits.joint_deceleration", 2.0), ("jerk=\"50.0\"", "limits.jerk", 50.0)]
    {
        let slow = format!("{}=\"0.01\"", limit.split_once('=').unwrap().0);
        let (store, warnings) = start(&ARM.replace(limit, &slow), &[]);
        assert_eq!(numbers(&store, name)[0], taken);
        assert!(warnings.len() == 1 && warnings[0].contains("does not stop it in time"), "{warnings:?}");
        assert!(ServoParameters::from_store(&store).is_ok());
    }
    let (plain, _) = start(&ARM.replace(" deceleration=\"5.0\" jerk=\"50.0\"", ""), &[]);
    assert_eq!(numbers(&plain, "limits.joint_deceleration"), Vec::<f64>::new());
    assert_eq!(numbers(&plain, "limits.jerk"), Vec::<f64>::new());
}

#[test]
fn a_urdf_capsule_becomes_the_capsule_of_the_body() {
    let (store, warnings) = start(ARM, &[("constraints", Value::Bool(true))]);
    assert_eq!(warnings, Vec::<String>::new());
    let scene = ServoParameters::from_store(&store).unwrap().settings.scene.unwrap();
    let [first, second, ..] = &scene.body().capsules[..] else { panic!() };
    assert_eq!((first.link, second.link), (0, 1));
    // The capsule extends by 0.25 m to both sides of an origin 0.25 m above the joint. The capsule has its own radius; the
    // parameter rounds to a tenth of a millimeter.
    let mut ends = second.core.ends.map(|end| end.z);
    ends.sort_by(f64::total_cmp);
    assert_eq!(ends, [0.0, 0.5]);
    assert!((0.1..0.1002).contains(&second.radius), "{second:?}");
}
