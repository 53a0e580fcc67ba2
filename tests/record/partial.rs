//! Tests bags that have only a part of a run: missing parts are reported, and figures leave them empty.

use crate::bags::{DEMO, Sample, alter, demo, demo_with, dq_servo, read, write};
use crate::runs::only_run;
use dq_bags::WriterOptions;
use dq_figures::{Figure, Width};
use dq_messages::ParameterEvent;
use dq_messages::messages::JointState;
use dq_metrics::GoalError;
use dq_runs::{RecordedRun, plot};
use std::path::Path;

const SECOND: i64 = 1_000_000_000;

/// Returns the time at which the first goal of the demo arrived \[ns\].
fn first_goal(messages: &[Sample]) -> i64 {
    messages.iter().find(|message| message.topic == "/goal_pose").unwrap().time
}

/// Writes the demo's bag with changed joint states.
fn with_joint_states(bag: &Path, mut change: impl FnMut(i64, &mut JointState)) {
    demo_with(bag, |messages| {
        for message in messages.iter_mut().filter(|message| message.topic == "/joint_states") {
            let time = message.time;
            alter(message, |state| change(time, state));
        }
    });
}

#[test]
fn speeds_that_are_not_in_the_bag_are_not_made_up() {
    let directory = tempfile::tempdir().unwrap();
    let (states, bag) = (directory.path().join("states"), directory.path().join("bag"));
    with_joint_states(&states, |_, state| state.velocity.clear());
    let mut messages = read(&states);
    let run = only_run(&states);
    let figures = plot(&[run]);
    let speeds = figures.iter().find(|figure| figure.name == "joint_velocities").unwrap().svg(Width::Screen);
    assert!(speeds.contains("command") && !speeds.contains("measured"));
    messages.retain(|message| !message.topic.ends_with("/commands"));
    write(&bag, WriterOptions::default(), &messages);
    let (code, _, said) = dq_servo(&[&"plot", &bag, &"--out", &bag.with_extension("plots")]);
    assert_eq!(code, Some(0));
    assert!(said.contains("no joint velocities and no commands"), "{said}");
    assert!(!bag.with_extension("plots").join("joint_velocities.png").exists());
}

fn figure(run: &RecordedRun, name: &str) -> Figure {
    plot(std::slice::from_ref(run)).into_iter().find(|figure| figure.name == name).unwrap()
}

/// Returns the number of lines in a figure that have a color of one of the demo's laws.
fn lines(run: &RecordedRun, name: &str) -> usize {
    let colored = |line: &&str| line.contains("#D55E00") || line.contains("#0072B2");
    figure(run, name)
        .svg(Width::Screen)
        .lines()
        .filter(|line| line.contains("<polyline"))
        .filter(colored)
        .count()
}

/// Returns the longest line between two points of the path \[m\].
fn longest_step(run: &RecordedRun) -> f64 {
    let data = figure(run, "path").data;
    let steps = data["scenes"][0]["paths"].as_array().unwrap().iter().flat_map(|path| {
        let points: Vec<[f64; 3]> = serde_json::from_value(path["points_m"].clone()).unwrap();
        let distance = |pair: &[[f64; 3]]| {
            (0..3).map(|axis| (pair[1][axis] - pair[0][axis]).powi(2)).sum::<f64>().sqrt()
        };
        points.windows(2).map(distance).collect::<Vec<_>>()
    });
    steps.fold(0.0, f64::max)
}

#[test]
fn a_jump_of_the_robot_or_of_its_tool_is_not_part_of_the_path() {
    let directory = tempfile::tempdir().unwrap();
    let whole = only_run(Path::new(DEMO));
    let middle = first_goal(&demo()) + 2 * SECOND;
    let reset = directory.path().join("reset");
    with_joint_states(&reset, |time, state| state.position[0] += if time > middle { 1.0 } else { 0.0 });
    let reset = only_run(&reset);
    assert!(longest_step(&whole) < 0.05 && longest_step(&reset) < 0.05, "{}", longest_step(&reset));
    assert_eq!(lines(&reset, "joint_positions"), lines(&whole, "joint_positions") + 6);
    let mut messages = demo();
    let mut changes = 0;
    for message in messages.iter_mut().filter(|message| message.topic == "/dq_servo/parameters") {
        alter(message, |event: &mut ParameterEvent| {
            let mut tool = event.new_parameters.iter_mut().filter(|one| one.name == "tool_offset");
            if let Some(tool) = tool.next().filter(|_| !event.changed_parameters.is_empty()) {
                (tool.value.kind, tool.value.double_array_value) =
                    (8, vec![0.0, 0.0, 0.2, 0.0, 0.0, 0.0, 1.0]);
                changes += 1;
            }
        });
    }
    let tool = directory.path().join("tool");
    write(&tool, WriterOptions::default(), &messages);
    let tool = only_run(&tool);
    assert_eq!((changes, tool.samples.iter().filter(|sample| sample.jumped).count()), (1, 1));
    assert!(longest_step(&tool) < 0.05);
}

#[test]
fn a_time_without_a_goal_has_no_pose_error() {
    let whole = only_run(Path::new(DEMO));
    let mut stopped = whole.clone();
    let none = GoalError { position: f64::NAN, rotation: f64::NAN };
    stopped.errors[200..300].iter_mut().for_each(|(_, error)| *error = none);
    assert_eq!(lines(&stopped, "pose_error"), lines(&whole, "pose_error") + 2, "one in each panel");
}
