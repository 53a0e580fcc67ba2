//! Runs followed event by event.

use super::*;
use crate::config::{DualParameters, ServoParameters};
use crate::params::{Given, Value};
use crate::servo::{OneArm, TwoArms};
use crate::wire::messages::{JointState, PoseStamped};
use crate::wire::status::KeyValues;
use crate::wire::{CycleLabel, GUARD_LABEL, Parameter, command_array};
use std::time::Duration;

/// Follows a bag of one PUMA 560, which has its servo's parameters where `known`.
fn follower(interface: &str, known: bool) -> Follower<OneArm> {
    let given = Given {
        name: "command_interface".to_owned(),
        value: Value::String(interface.to_owned()),
        source: String::new(),
        by_name: true,
    };
    let (store, _) = ServoParameters::start("/dq_servo", vec![given]).unwrap();
    let parameters = ServoParameters::from_store(&store).unwrap();
    Follower::new("bag".to_owned(), parameters, known.then(|| (store, Numbers::default())))
}

/// All joints at this angle.
fn state(angle: f64) -> Event {
    let name = (1..=6).map(|joint| format!("joint{joint}")).collect();
    Event::JointState(0, JointState { name, position: vec![angle; 6], ..JointState::default() })
}

fn goal(x: f64) -> Event {
    Event::Goal(PoseStamped { pose: [x, 0.2, 0.3, 0.0, 0.0, 0.0, 1.0].into(), ..PoseStamped::default() })
}

/// A status in that state, which names a goal where there is one.
fn status(state: &str, input: &str, goal: Option<f64>) -> Event {
    let mut values = KeyValues::default();
    values.add("law", "logc");
    values.add("input", input);
    values.add_some("goal", goal.map(|x| format!("{x} 0.2 0.3 0 0 0 1")));
    values.add_some("elapsed_s", goal.map(|_| 0.0));
    Event::Status(DiagnosticStatus { message: state.to_owned(), values: values.list, ..Default::default() })
}

/// A servo's command by velocities that was made at that time \[s\] of its clock, after so many stops.
fn command(now: f64, stops: u64) -> Event {
    let label = CycleLabel { stops, now: Duration::from_secs_f64(now), ..CycleLabel::new(1) };
    Event::Command(0, command_array(vec![0.0; 6], &label.to_string()))
}

fn follow(follower: &mut Follower<OneArm>, events: Vec<(f64, Event)>) {
    for (time, event) in events {
        follower.take(time, event).unwrap();
    }
}

#[test]
fn a_stop_ends_a_motion_whatever_the_commands_are() {
    for interface in ["velocity", "position"] {
        let mut follower = follower(interface, false);
        let command = |stops| {
            let label = CycleLabel { stops, ..CycleLabel::new(1) };
            match interface {
                "velocity" => Event::Command(0, command_array(vec![0.0; 6], &label.to_string())),
                _ => Event::Positions(0, vec![0.5; 6], Some(label)),
            }
        };
        let motion =
            |time, stops| vec![(time, state(0.5)), (time + 0.1, goal(0.1)), (time + 0.2, command(stops))];
        follow(&mut follower, motion(0.0, 0));
        follow(&mut follower, vec![(0.3, command(1))]);
        follow(&mut follower, motion(0.4, 1));
        assert_eq!(follower.finish().unwrap().motions.len(), 2, "{interface}");
    }
}

#[test]
fn a_stop_before_the_bag_began_ends_no_motion_nor_does_a_command_of_others() {
    let mut follower = follower("velocity", false);
    let others = Event::Command(0, command_array(vec![0.0; 6], GUARD_LABEL));
    let events = vec![
        (0.0, state(0.5)),
        (0.1, goal(0.1)),
        (0.2, command(0.2, 1)),
        (0.3, others),
        (0.4, command(0.4, 1)),
        (0.5, state(0.5)),
        (0.6, status("tracking", "goal", Some(0.1))),
        (0.7, command(0.7, 1)),
    ];
    follow(&mut follower, events);
    let motions = follower.finish().unwrap().motions;
    assert_eq!(motions.len(), 1);
    assert!((motions[0].figures.elapsed - 0.6).abs() < 1e-9, "{motions:?}");
}

#[test]
fn a_goal_in_a_frame_that_comes_back_is_another_motion() {
    let mut follower = follower("velocity", false);
    follow(&mut follower, vec![(0.0, state(0.5))]);
    for (time, x) in [(0.0, 0.1), (5.0, 0.3), (10.0, 0.1)] {
        for cycle in 0..40 {
            let time = time + 0.1 * f64::from(cycle);
            follow(
                &mut follower,
                vec![(time, status("tracking", "goal", Some(x))), (time, command(time, 0))],
            );
        }
    }
    let run = follower.finish().unwrap();
    assert_eq!((run.motions.len(), run.goals.len()), (3, 3));
}

/// The frame of the goal is lost at 2 s and found at 4 s, when the servo goes on: its motion began with the goal.
#[test]
fn a_goal_that_moves_while_the_servo_holds_begins_no_motion_and_misses_nothing() {
    let mut follower = follower("velocity", false);
    follow(&mut follower, vec![(0.0, state(0.5))]);
    for tenth in 0..60 {
        let time = 0.1 * f64::from(tenth);
        let says = if (20..40).contains(&tenth) { "holding" } else { "tracking" };
        let Event::Status(mut status) = status(says, "goal", Some(0.1 + 0.001 * f64::from(tenth))) else {
            unreachable!()
        };
        let elapsed = status.values.iter_mut().find(|value| value.key == "elapsed_s").unwrap();
        elapsed.value = time.to_string();
        follow(&mut follower, vec![(time, Event::Status(status)), (time, command(time, 0))]);
    }
    let motions = follower.finish().unwrap().motions;
    let begun: Vec<_> = motions.iter().map(|motion| (motion.start_s.round(), motion.missing_s)).collect();
    assert_eq!(begun, [(0.0, None), (4.0, None)]);
}

/// A command that is recorded before the joint state with which the other tool is known.
#[test]
fn a_motion_of_another_tool_begins_where_that_is() {
    let mut follower = follower("velocity", true);
    let offset = Value::DoubleArray(vec![0.0, 0.0, 0.5, 0.0, 0.0, 0.0, 1.0]);
    let offset = Parameter { name: "tool_offset".to_owned(), value: (&offset).into() };
    let event = ParameterEvent { changed_parameters: vec![offset], ..ParameterEvent::default() };
    let events = vec![
        (0.0, state(0.5)),
        (0.1, goal(0.1)),
        (0.2, Event::Parameters(event)),
        (0.21, command(0.21, 0)),
        (0.22, state(0.5)),
        (0.23, command(0.23, 0)),
    ];
    follow(&mut follower, events);
    let motions = follower.finish().unwrap().motions;
    assert!(motions.len() == 2 && motions[1].figures.path_length < 1e-9, "{motions:?}");
}

/// It was stopped by its shutdown, and counts goals, stops and commands from the beginning; only the clock goes on.
#[test]
fn a_servo_that_was_started_again_has_reason_to_move() {
    let mut follower = follower("velocity", true);
    let command = |now: f64, (goals, stops, sent), speed| {
        let label =
            CycleLabel { goals, stops, sent, now: Duration::from_secs_f64(now), ..CycleLabel::new(1) };
        (now, Event::Command(0, command_array(vec![speed; 6], &label.to_string())))
    };
    let events = vec![
        (0.0, state(0.5)),
        command(0.1, (1, 0, 1), 0.0),
        command(0.102, (1, 1, 2), 0.0),
        command(5.0, (1, 0, 1), 0.01),
        command(5.002, (1, 0, 2), 0.02),
    ];
    follow(&mut follower, events);
    let run = follower.finish().unwrap();
    assert_eq!(run.violations, []);
    assert!(run.jitter.iter().all(|(_, late)| late.abs() < 1.0), "{:?}", run.jitter);
}

#[test]
fn a_status_made_before_a_goal_was_taken_does_not_bring_back_the_one_before() {
    let mut follower = follower("velocity", false);
    let events = vec![
        (0.0, state(0.5)),
        (0.0, goal(0.3)),
        (0.05, status("tracking", "goal", Some(0.1))),
        (0.15, status("tracking", "goal", Some(0.3))),
        (2.0, status("tracking", "goal", Some(0.3))),
        (2.0, command(2.0, 0)),
    ];
    follow(&mut follower, events);
    let run = follower.finish().unwrap();
    assert_eq!((run.goals.len(), run.motions.len()), (1, 1));
    assert!((run.goals[0].1.translation().x - 0.3).abs() < 1e-12);
}

#[test]
fn jogging_is_no_part_of_a_motion_and_a_goal_that_comes_meanwhile_begins_none() {
    let mut follower = follower("velocity", false);
    let to_the_goal = vec![(0.0, state(0.5)), (0.0, goal(0.1)), (0.1, state(0.51)), (0.1, command(0.1, 0))];
    follow(&mut follower, to_the_goal);
    follow(&mut follower, vec![(0.2, status("tracking", "twist", None)), (0.3, goal(0.2))]);
    for k in 0..20 {
        let time = 0.4 + 0.1 * f64::from(k);
        follow(&mut follower, vec![(time, state(0.51 + 0.01 * time)), (time, command(time, 0))]);
        follow(&mut follower, vec![(time, status("tracking", "twist", None))]);
    }
    let run = follower.finish().unwrap();
    assert_eq!(run.motions.len(), 1);
    assert!(run.motions[0].figures.elapsed < 0.15, "{:?}", run.motions);
    assert!(run.samples.last().unwrap().error.is_none(), "there is no goal any more");
}

#[test]
fn a_guard_s_commands_are_none_of_the_servo_s() {
    for interface in ["velocity", "position"] {
        let mut follower = follower(interface, true);
        follow(&mut follower, vec![(3.0, state(0.5))]);
        let send = |follower: &mut Follower<OneArm>, time: f64, now: Option<f64>, angle: f64| {
            let label = now.map(|now| CycleLabel { now: Duration::from_secs_f64(now), ..CycleLabel::new(1) });
            let event = match interface {
                "velocity" => {
                    let label = label.map_or_else(|| GUARD_LABEL.to_owned(), |label| label.to_string());
                    Event::Command(0, command_array(vec![0.0; 6], &label))
                }
                _ => Event::Positions(0, vec![angle; 6], label),
            };
            follow(follower, vec![(time, event)]);
        };
        for cycle in 0..10 {
            let past = 0.002 * f64::from(cycle);
            send(&mut follower, 3.0 + past, Some(86400.0 + past), 0.5 + 0.1 * past);
        }
        send(&mut follower, 3.02, None, 0.5018);
        send(&mut follower, 3.022, Some(86400.022), 0.5022);
        let run = follower.finish().unwrap();
        assert_eq!(run.commands.len(), 12, "{interface}");
        let most = run.jitter.iter().map(|(_, jitter)| jitter.abs()).fold(0.0, f64::max);
        assert!((run.jitter.len(), most < 3.0) == (10, true), "{interface}: {:?}", run.jitter);
        let (_, last) = run.commands.last().unwrap();
        let expected = if interface == "position" { 0.1 } else { 0.0 };
        assert!((last[0] - expected).abs() < 1e-6, "{interface}: {last:?}");
    }
}

#[test]
fn joints_that_wrap_or_have_another_limit_meanwhile_do_not_jump() {
    let mut follower = follower("velocity", true);
    let angle = std::f64::consts::PI - 0.001;
    follow(&mut follower, vec![(0.0, state(angle)), (0.002, state(-angle))]);
    let limits = &mut follower.parameters.settings.limits;
    limits.joint_velocity.fill(0.05);
    follow(&mut follower, vec![(0.004, state(0.005 - angle))]);
    assert!(follower.run.samples.iter().all(|sample| !sample.jumped));
    follow(&mut follower, vec![(0.006, state(1.0 - angle))]);
    assert!(follower.run.samples[3].jumped);
}

#[test]
fn an_arm_that_reports_no_speeds_takes_none_from_the_other() {
    let (store, _) = DualParameters::start("/dq_dual_servo", Vec::new()).unwrap();
    let parameters = DualParameters::from_store(&store).unwrap();
    let name = parameters.joints[0].names().to_vec();
    let mut follower = Follower::<TwoArms>::new("bag".to_owned(), parameters, None);
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
