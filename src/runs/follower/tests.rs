//! Runs followed event by event.

use super::*;
use crate::config::{DualParameters, ServoParameters};
use crate::params::{Given, Value};
use crate::servo::{OneArm, TwoArms};
use crate::wire::messages::{JointState, PoseStamped};
use crate::wire::{CycleLabel, command_array};

#[test]
fn a_stop_ends_a_motion_whatever_the_commands_are() {
    for interface in ["velocity", "position"] {
        let given = Given {
            name: "command_interface".to_owned(),
            value: Value::String(interface.to_owned()),
            source: String::new(),
            by_name: true,
        };
        let (store, _) = ServoParameters::start("/dq_servo", vec![given]).unwrap();
        let parameters = ServoParameters::from_store(&store).unwrap();
        let name = parameters.joints[0].names().to_vec();
        let mut follower = Follower::<OneArm>::new("bag".to_owned(), parameters, None, Numbers::default());
        let state = JointState { name, position: vec![0.5; 6], ..JointState::default() };
        let goal = PoseStamped { pose: [0.1, 0.2, 0.3, 0.0, 0.0, 0.0, 1.0].into(), ..PoseStamped::default() };
        let command = |stops| {
            let label = CycleLabel { stops, ..CycleLabel::new(1) };
            match interface {
                "velocity" => Event::Command(0, command_array(vec![0.0; 6], &label.to_string())),
                _ => Event::Positions(0, vec![0.5; 6], Some(label)),
            }
        };
        follower.take(0.0, Event::JointState(0, state.clone())).unwrap();
        follower.take(0.1, Event::Goal(goal.clone())).unwrap();
        follower.take(0.2, command(0)).unwrap();
        follower.take(0.3, command(1)).unwrap();
        follower.take(0.4, Event::JointState(0, state.clone())).unwrap();
        follower.take(0.5, Event::Goal(goal)).unwrap();
        follower.take(0.6, command(1)).unwrap();
        assert_eq!(follower.finish().unwrap().motions.len(), 2, "{interface}");
    }
}

#[test]
fn an_arm_that_reports_no_speeds_takes_none_from_the_other() {
    let (store, _) = DualParameters::start("/dq_dual_servo", Vec::new()).unwrap();
    let parameters = DualParameters::from_store(&store).unwrap();
    let name = parameters.joints[0].names().to_vec();
    let mut follower = Follower::<TwoArms>::new("bag".to_owned(), parameters, None, Numbers::default());
    let state = |velocity| JointState {
        name: name.clone(),
        position: vec![0.5; 6],
        velocity,
        ..JointState::default()
    };
    follower.take(0.0, Event::JointState(0, state(vec![0.25; 6]))).unwrap();
    follower.take(0.0, Event::JointState(1, state(Vec::new()))).unwrap();
    let velocities = &follower.run.samples[0].velocities;
    assert_eq!(velocities[..6], [0.25; 6]);
    assert!(velocities[6..].iter().all(|speed| speed.is_nan()), "{velocities:?}");
}
