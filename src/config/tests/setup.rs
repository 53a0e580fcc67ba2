//! Tests of chains and servos by name, by robot description and by DH rows.

use crate::described::{GANTRY, frames};
use crate::{started, text};
use dq_config::{ARMS, BUILTIN_FILE, ForArm, NodeParameters, ServoParameters, SetupError};
use dq_core::servo::Servo;
use dq_kinematics::arm::{Chain, Convention, DhRow};
use dq_params::parameters_for;
use std::time::Duration;

#[test]
fn every_built_in_arm_has_its_servo_by_name_and_other_names_are_rejected() {
    for (name, text) in ARMS {
        let parameters = ServoParameters::for_arm(name).unwrap();
        let values = parameters_for(text, name, "/dq_servo").unwrap();
        assert_eq!(parameters, ServoParameters::from_values(values, name).unwrap());
        assert_eq!(&Chain::for_arm(name).unwrap(), parameters.arms.chain());
        assert_eq!(Servo::for_arm(name).unwrap().settings(), &parameters.settings);
    }
    let refused = Chain::for_arm("ur6e").unwrap_err();
    assert_eq!(refused, SetupError::UnknownArm("ur6e".to_owned()));
    assert!(
        refused.to_string().starts_with("no built-in arm is called \"ur6e\": expected one of puma560, ur3e")
    );
    assert!(Servo::for_arm("").is_err());
}

#[test]
fn a_robot_description_equals_its_parameters_and_what_it_lacks_is_reported() {
    let values = [&[("robot_description", text(GANTRY))][..], &frames("a", "e")].concat();
    let parameters = ServoParameters::from_urdf(GANTRY, "a", "e").unwrap();
    assert_eq!(parameters, started(&values).unwrap());
    assert_eq!(parameters.build().unwrap().settings().limits.joint_velocity, [1.5, 0.5, 3.0]);
    let why = |text: &str, tool| ServoParameters::from_urdf(text, "a", tool).err().unwrap().to_string();
    assert!(why(GANTRY, "jib").contains("jib"), "{}", why(GANTRY, "jib"));
    let without = GANTRY.replace("velocity='1.5'", "");
    assert!(why(&without, "e").contains("\"j1\" has no velocity limit"), "{}", why(&without, "e"));
    assert!(!why("<robot", "e").is_empty());
}

#[test]
fn your_own_arm_needs_one_limit_per_joint() {
    let row = |a| DhRow { alpha: 0.0, a, d: 0.0, theta_offset: 0.0 };
    let chain = Chain::new(Convention::StandardDh, &[row(0.5), row(0.25)]).unwrap();
    let of = |velocity: &[f64], acceleration: &[f64]| {
        ServoParameters::for_chain(chain.clone(), velocity, acceleration)
    };
    let parameters = of(&[1.0, 2.0], &[3.0, 4.0]).unwrap();
    assert_eq!(parameters.joints[0].names(), ["joint1", "joint2"]);
    let limits = &parameters.settings.limits;
    assert_eq!((limits.deceleration(0), limits.position.upper[1]), (3.0, f64::INFINITY));
    // All other settings are as in a node without settings.
    let values = parameters_for(BUILTIN_FILE, "", "/dq_servo").unwrap();
    let node = ServoParameters::from_values(values, "").unwrap();
    assert_eq!(parameters.settings.controller, node.settings.controller);
    let refused = of(&[1.0], &[3.0, 4.0]).unwrap_err().to_string();
    assert_eq!(refused, "limits.joint_velocity has 1 entries, expected 2: one per joint");
    assert!(of(&[1.0, f64::NAN], &[3.0, 4.0]).is_err());
    let never = parameters.with_period(Duration::ZERO).build().err().unwrap().to_string();
    assert_eq!(never, "period has 0, expected a time above 0");
}
