//! Tests that each built-in arm, and an arm from a robot description, moves to a goal and back.

use crate::rig::Rig;
use dq_config::{ARMS, NodeParameters, PlantParameters, ServoParameters, arm_file};
use dq_core::servo::{PositionLimits, Stall, State};
use dq_kinematics::control::Law;
use dq_params::{ParameterOverride, parameters_for};

pub fn given(name: &str) -> Vec<ParameterOverride> {
    let (name, text) = arm_file(name).unwrap();
    let values = parameters_for(text, name, "/dq_servo").unwrap().into_iter();
    values.map(|(name, value)| ParameterOverride::new(name, value, "the box")).collect()
}

pub fn servo(name: &str) -> ServoParameters {
    let (store, warnings) = ServoParameters::start("/dq_servo", given(name)).unwrap();
    assert_eq!(warnings, [""; 0]);
    ServoParameters::from_store(&store).unwrap()
}

pub fn start(name: &str) -> Vec<f64> {
    let (store, _) = PlantParameters::start("/arm", given(name)).unwrap();
    PlantParameters::from_store(&store).unwrap().initial_positions
}

#[test]
fn each_arm_moves_there_and_back_within_its_limits() {
    assert!(arm_file("ur6e").is_none());
    for (name, _) in ARMS {
        let (parameters, start) = (servo(name), start(name));
        let chain = parameters.arms.chain().clone();
        let there = parameters.settings.limits.position.beside(&start, chain.kinds());
        let mut rig = Rig::of(parameters, start.clone());
        rig.run(0.1);
        // `demo --arm` uses these laws, too.
        for (goal, law) in [(&there, Law::Logc), (&start, Law::Diffc)] {
            let pose = chain.forward_kinematics(goal).unwrap();
            rig.set_law(law);
            rig.goal_pose(&pose);
            rig.run_until(State::Tracking, 1.0);
            rig.run_until(State::Settled, 40.0);
            let tool = chain.forward_kinematics(rig.plants[0].positions()).unwrap();
            assert!((tool.translation() - pose.translation()).norm() < 1e-3, "{name}");
            assert!(tool.rotation().angle_to(&pose.rotation()) < 1e-2, "{name}");
        }
    }
}

/// Returns joint positions that differ for each `number` and are the same in each run \[rad, prismatic: m\]. Successive numbers spread
/// the positions evenly over the joints' ranges, at least 0.1 from each end. Only the part of a range between −3 and 3 is used.
pub fn anywhere(limits: &PositionLimits, number: usize) -> Vec<f64> {
    let steps = [0.618_034, 0.414_214, 0.732_051, 0.236_068, 0.645_751, 0.316_625, 0.872_983];
    let parts = steps.map(|step| (0.5 + step * number as f64).fract());
    let ranges =
        limits.lower.iter().zip(&limits.upper).map(|(lower, upper)| (lower.max(-3.0), upper.min(3.0)));
    ranges.zip(parts).map(|((lower, upper), part)| lower + 0.1 + part * (upper - lower - 0.2)).collect()
}

#[test]
fn rule_18_no_sound_motion_is_taken_for_an_oscillation() {
    for (name, _) in ARMS {
        for (number, law) in (1..=16).map(|number| (number, [Law::Diffc, Law::Logc][number % 2])) {
            let parameters = servo(name);
            let limits = &parameters.settings.limits.position;
            let (start, goal) = (anywhere(limits, number), anywhere(limits, number + 100));
            let pose = parameters.arms.chain().forward_kinematics(&goal).unwrap();
            let mut rig = Rig::of(parameters, start);
            rig.set_law(law);
            rig.run(0.1);
            rig.goal_pose(&pose);
            rig.run(3.0);
            assert_ne!(rig.servo.status().stall, Some(Stall::Oscillating), "{name} {law} {number}");
        }
    }
}

/// The TIAGo's arm has a prismatic joint, the torso lift, and revolute joints.
#[test]
fn a_described_arm_with_a_prismatic_joint_moves_there_and_back_within_its_limits() {
    let text = |value: &str| dq_params::Value::String(value.to_owned());
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/data/urdf/tiago.urdf");
    let values = [
        ("robot_file", text(file)),
        ("base_frame", text("base_link")),
        ("tool_frame", text("arm_tool_link")),
    ];
    let given = values.map(|(name, value)| ParameterOverride::new(name, value, "test"));
    let (store, _) = ServoParameters::start("/dq_servo", given.to_vec()).unwrap();
    let parameters = ServoParameters::from_store(&store).unwrap();
    let (store, _) = PlantParameters::start("/arm", given.to_vec()).unwrap();
    let start = PlantParameters::from_store(&store).unwrap().initial_positions;
    let limits = parameters.settings.limits.clone();
    let inside = start.iter().zip(limits.position.lower.iter().zip(&limits.position.upper));
    assert!(
        inside.clone().all(|(position, (lower, upper))| lower < position && position < upper),
        "{start:?}"
    );
    let chain = parameters.arms.chain().clone();
    let mut there = start.clone();
    (there[0], there[4]) = (there[0] + 0.1, there[4] + 0.3);
    let mut rig = Rig::of(parameters, start.clone());
    rig.run(0.1);
    let mut slid = 0.0_f64;
    for goal in [&there, &start] {
        rig.goal_pose(&chain.forward_kinematics(goal).unwrap());
        rig.run_until(State::Tracking, 1.0);
        rig.run_until(State::Settled, 60.0);
        slid = slid.max((rig.plants[0].positions()[0] - start[0]).abs());
    }
    assert!(slid > 0.01, "the torso takes part: {slid} m");
}
