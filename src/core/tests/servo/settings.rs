//! Tests of settings that a servo rejects, when it is built and while it runs.

use crate::reference::parameters;
use crate::rig::{PERIOD, Rig};
use dq_algebra::UnitDualQuaternion;
use dq_config::ServoParameters;
use dq_core::servo::{
    Event, Interface, JointOrder, Limits, PositionLimits, Posture, Rejection, Servo, Settings, SettingsError,
};
use dq_kinematics::control::Law;
use nalgebra::{UnitQuaternion, Vector3};

type Spoil = fn(&mut Settings);

/// Invalid settings, each with the name of its error.
const SPOILT: [(Spoil, &str); 28] = [
    (|settings| settings.limits.joint_velocity.truncate(5), "limits.joint_velocity"),
    (|settings| settings.limits.joint_velocity.push(1.0), "limits.joint_velocity"),
    (|settings| settings.limits.joint_acceleration.truncate(5), "limits.joint_acceleration"),
    (|settings| settings.limits.joint_deceleration.truncate(5), "limits.joint_deceleration"),
    (|settings| settings.limits.position.lower.truncate(5), "limits.position.lower"),
    (|settings| settings.limits.position.upper.truncate(5), "limits.position.upper"),
    (|settings| settings.posture = Posture { positions: vec![1.0; 3], gain: 1.0 }, "posture.positions"),
    (|settings| settings.posture = Posture { positions: vec![f64::NAN; 6], gain: 1.0 }, "posture.positions"),
    (|settings| settings.posture.gain = -1.0, "posture.gain"),
    (|settings| settings.limits.joint_velocity[2] = f64::NAN, "limits.joint_velocity"),
    (|settings| settings.limits.joint_velocity[2] = -1.0, "limits.joint_velocity"),
    (|settings| settings.limits.joint_acceleration[2] = f64::NAN, "limits.joint_acceleration"),
    (|settings| settings.limits.joint_deceleration[2] = f64::INFINITY, "limits.joint_deceleration"),
    (|settings| settings.limits.linear_speed = -1.0, "limits.linear_speed"),
    (|settings| settings.limits.linear_speed = f64::NAN, "limits.linear_speed"),
    (|settings| settings.limits.angular_speed = f64::INFINITY, "limits.angular_speed"),
    (|settings| settings.limits.position.lower[2] = f64::NAN, "limits.position.lower"),
    (|settings| settings.limits.position.upper[2] = f64::NAN, "limits.position.upper"),
    (|settings| settings.limits.position.margin = f64::NAN, "limits.position.margin"),
    (
        |settings| (settings.limits.position.lower[2], settings.limits.position.upper[2]) = (1.0, 0.9),
        "limits.position.upper",
    ),
    (|settings| settings.tool_offset = not_a_number(), "tool_offset"),
    (|settings| settings.hysteresis = f64::NAN, "hysteresis"),
    (|settings| settings.controller.damping.max = f64::NAN, "damping.max"),
    (|settings| settings.controller.damping.threshold = -1.0, "damping.threshold"),
    (|settings| settings.goal_tolerance.linear = f64::NAN, "goal_tolerance.linear"),
    (|settings| settings.following_error = f64::NAN, "following_error"),
    (|settings| settings.controller.set_gains(Law::Logc, [1.0, f64::NAN]), "gains.logc"),
    (|settings| settings.controller.set_gains(Law::Diffc, [-1.0, 0.0]), "gains.diffc"),
];

fn not_a_number() -> UnitDualQuaternion {
    UnitDualQuaternion::from_parts(UnitQuaternion::identity(), Vector3::repeat(f64::NAN))
}

fn in_motion() -> Rig {
    let rig = Rig::in_motion(0.3);
    assert!(rig.speed() > 0.1);
    rig
}

#[test]
fn settings_that_cannot_be_are_refused_by_name_and_a_servo_that_runs_goes_on_with_what_it_had() {
    let mut undisturbed = in_motion();
    undisturbed.run(0.2);
    for (spoil, name) in SPOILT {
        let ServoParameters { arms, joints, mut settings, .. } = parameters();
        spoil(&mut settings);
        let refused = Servo::new(arms, joints, "", settings, PERIOD).err().expect(name);
        assert!(refused.to_string().starts_with(&format!("{name} has ")), "{name}: {refused}");
        let mut rig = in_motion();
        let before = (rig.servo.settings().clone(), rig.servo.configurations());
        let mut settings = before.0.clone();
        spoil(&mut settings);
        assert_eq!(rig.servo.configure(settings).map_err(|why| why.to_string()), Err(refused.to_string()));
        assert_eq!((rig.servo.settings(), rig.servo.configurations()), (&before.0, before.1));
        rig.run(0.2);
        assert_eq!(rig.command, undisturbed.command, "{name}");
    }
}

#[test]
fn limits_of_another_arm_are_refused_by_their_name() {
    let ServoParameters { arms, mut settings, .. } = parameters();
    let order = |count: usize| vec![JointOrder::new((1..=count).map(|i| format!("joint{i}")).collect())];
    let joints = Servo::new(arms.clone(), order(7), "", settings.clone(), PERIOD).err();
    assert_eq!(joints, Some(SettingsError::Length { list: "joints", expected: 6, got: 7 }));
    settings.limits = Limits {
        joint_velocity: vec![1.0; 7],
        joint_acceleration: vec![1.0; 7],
        joint_deceleration: vec![1.0; 7],
        joint_jerk: vec![f64::INFINITY; 7],
        position: PositionLimits::none(7),
        ..settings.limits
    };
    let limits = Servo::new(arms.clone(), order(arms.joint_count()), "", settings, PERIOD).err();
    let why = "limits.joint_velocity has 7 entries, expected 6: one per joint";
    assert_eq!(limits.map(|why| why.to_string()).as_deref(), Some(why));
}

#[test]
fn what_the_robot_takes_stays_as_it_is_while_the_servo_runs() {
    for interface in [Interface::Position, Interface::Trajectory] {
        let mut rig = in_motion();
        let settings = Settings { interface, ..rig.servo.settings().clone() };
        let expected = Interface::Velocity;
        let refused = Err(SettingsError::AnotherInterface { expected, got: interface });
        assert_eq!(rig.servo.configure(settings), refused);
        rig.run(0.01);
        assert_eq!(rig.servo.output(), Some(rig.servo.command()), "velocities");
    }
}

#[test]
fn settings_that_a_cycle_does_not_take_are_counted() {
    let mut rig = in_motion();
    let before = rig.servo.settings().clone();
    let (mut bad, mut good) = (before.clone(), before.clone());
    bad.limits.joint_velocity.pop();
    good.limits.linear_speed = 1.0;
    let configure = |settings| [Event::Configure(Box::new(settings))];
    rig.now += PERIOD;
    rig.servo.cycle_with(rig.now, configure(bad));
    assert_eq!(rig.servo.settings(), &before);
    assert_eq!(rig.servo.rejections().by_reason(), [("settings", 1)]);
    let why = SettingsError::Length { list: "limits.joint_velocity", expected: 6, got: 5 };
    assert_eq!(rig.servo.rejections().last(), Some(&Rejection::Settings(why)));
    rig.now += PERIOD;
    rig.servo.cycle_with(rig.now, configure(good.clone()));
    assert_eq!((rig.servo.settings(), rig.servo.rejections().total()), (&good, 1));
}
