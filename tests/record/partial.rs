//! Bags that have part of a run: what is not in them is reported, and made up by no figure.

use crate::bags::{Sample, alter, encode, read, write};
use crate::runs::{DEMO, demo_without, only_run, puma560, replay_demo, timeline};
use assert_cmd::Command;
use dq_servo::config::ServoParameters;
use dq_servo::draw::Figure;
use dq_servo::nodes::Prepared;
use dq_servo::record::WriterOptions;
use dq_servo::ros::args;
use dq_servo::runs::{Fallback, RecordedRun, plot, recorded};
use dq_servo::wire::messages::{Float64MultiArray, Header, JointState, Message, PoseStamped, Time};
use dq_servo::wire::{CycleLabel, Parameter, ParameterEvent, command_array};
use std::path::Path;
use std::time::Duration;

const SECOND: i64 = 1_000_000_000;

/// When the first goal of the demo came \[ns\].
fn first_goal(messages: &[Sample]) -> i64 {
    messages.iter().find(|message| message.topic == "/goal_pose").unwrap().time
}

/// The demo's bag with its joint states altered.
fn with_joint_states(bag: &Path, mut change: impl FnMut(i64, &mut JointState)) {
    let mut messages = read(Path::new(DEMO));
    for message in messages.iter_mut().filter(|message| message.topic == "/joint_states") {
        let time = message.time;
        alter(message, |state| change(time, state));
    }
    write(bag, WriterOptions::default(), &messages);
}

/// What `plot` says on stdout and on stderr.
fn plotted(bag: &Path, options: &[&str]) -> (String, String) {
    let mut command = Command::cargo_bin("dq_servo").unwrap();
    let output = command.arg("plot").arg(bag).arg("--out").arg(bag.with_extension("plots")).args(options);
    let output = output.output().unwrap();
    assert!(output.status.success());
    let [stdout, stderr] = [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).unwrap());
    (stdout, stderr)
}

/// As `record` has it that begins half a second after the goal, which is sent once more later on, or not.
#[test]
fn a_motion_that_began_before_the_bag_is_marked_with_what_is_missing() {
    let missing = |run: &RecordedRun| {
        let motions = run.motions.iter().map(|motion| serde_json::to_value(motion).unwrap());
        motions.map(|motion| motion["missing_s"].clone()).collect::<Vec<_>>()
    };
    assert_eq!(missing(&only_run(Path::new(DEMO))), vec![serde_json::Value::Null; 2], "it has all of both");
    let directory = tempfile::tempdir().unwrap();
    for again in [false, true] {
        let mut messages = read(Path::new(DEMO));
        let goal = first_goal(&messages);
        let cut = goal + SECOND / 2;
        let kept = |message: &Sample| message.time >= cut || message.topic.ends_with("/parameters");
        messages.retain(|message| kept(message) || again && message.time == goal);
        messages.iter_mut().filter(|message| message.time == goal).for_each(|message| message.time = cut);
        messages.sort_by_key(|message| message.time);
        let bag = directory.path().join(format!("again_{again}"));
        write(&bag, WriterOptions::default(), &messages);
        let missing = missing(&only_run(&bag));
        assert!((0.35..0.65).contains(&missing[0].as_f64().unwrap()) && missing[1].is_null(), "{missing:?}");
        let (table, _) = plotted(&bag, &[]);
        assert!(table.contains(" 1* ") && table.contains(" 2 ") && table.contains("\n* "), "{table}");
    }
    let whole = directory.path().join("without_goals");
    demo_without(&whole, |message| message.topic == "/goal_pose");
    assert_eq!(missing(&only_run(&whole)), vec![serde_json::Value::Null; 2], "a status comes soon");
}

#[test]
fn speeds_that_are_not_in_the_bag_are_not_made_up() {
    let directory = tempfile::tempdir().unwrap();
    let (states, bag) = (directory.path().join("states"), directory.path().join("bag"));
    with_joint_states(&states, |_, state| state.velocity.clear());
    let mut messages = read(&states);
    let run = only_run(&states);
    assert!(
        run.motions.iter().all(|motion| motion.figures.effort > 0.0),
        "it has commands: {:?}",
        run.motions
    );
    let figures = plot(&[run]).unwrap();
    let speeds = figures.iter().find(|figure| figure.name == "joint_velocities").unwrap();
    assert!(speeds.svg.contains("command") && !speeds.svg.contains("measured"));
    messages.retain(|message| !message.topic.ends_with("/commands"));
    write(&bag, WriterOptions::default(), &messages);
    let (rows, said) = plotted(&bag, &["--json"]);
    let rows: serde_json::Value = serde_json::from_str(&rows).unwrap();
    for figure in ["peak_joint_speed_rad_s", "effort_rad2_s"] {
        assert!(rows[0][figure].is_null() && rows[0]["path_length_m"].as_f64().unwrap() > 0.1, "{rows}");
    }
    assert!(said.contains("no joint velocities and no commands"), "{said}");
    assert!(!bag.with_extension("plots").join("joint_velocities.png").exists());
    let (table, _) = plotted(&bag, &[]);
    let row = table.lines().find(|line| line.starts_with("bag ")).unwrap();
    assert!(
        !table.contains("NaN") && row.split_whitespace().filter(|cell| *cell == "-").count() == 2,
        "{table}"
    );
}

/// One joint goes on by 1 mrad in each cycle of 2 ms, and every other cycle is missed.
#[test]
fn effort_is_of_the_speed_at_which_the_arm_is_sent_on() {
    let directory = tempfile::tempdir().unwrap();
    let (_, ros_args) =
        args::split(["--ros-args", "-p", "command_interface:=position"].iter().map(ToString::to_string))
            .unwrap();
    let prepared = Prepared::<ServoParameters>::new(&ros_args).unwrap();
    let fallback = Fallback { servo: prepared.parameters().clone(), ..puma560() };
    let name: Vec<_> = (1..=6).map(|joint| format!("joint{joint}")).collect();
    fn sample<M: Message>(topic: &str, time: i64, message: &M) -> Sample {
        Sample { topic: topic.to_owned(), message: M::TYPE.to_owned(), time, cdr: encode(message) }
    }
    let mut messages = Vec::new();
    for cycle in 0..=250_i32 {
        let time = SECOND + i64::from(cycle) * 4_000_000;
        let mut position = vec![0.5; 6];
        position[0] += 1e-3 * f64::from(cycle);
        let now = std::time::Duration::from_nanos(time.unsigned_abs());
        let label = CycleLabel { now, ..CycleLabel::new(1) };
        let stamp = Time {
            sec: i32::try_from(time / SECOND).unwrap(),
            nanosec: u32::try_from(time % SECOND).unwrap(),
        };
        let state = JointState {
            header: Header { stamp, ..Header::default() },
            name: name.clone(),
            position: position.clone(),
            velocity: vec![0.0; 6],
            ..JointState::default()
        };
        messages.push(sample("/joint_states", time, &state));
        if cycle == 0 {
            let pose = [0.1, 0.2, 0.3, 0.0, 0.0, 0.0, 1.0].into();
            messages.push(sample("/goal_pose", time, &PoseStamped { pose, ..PoseStamped::default() }));
        }
        let command = command_array(position, &label.to_string());
        messages.push(sample("/forward_position_controller/commands", time + 1000, &command));
    }
    let bag = directory.path().join("bag");
    write(&bag, WriterOptions::default(), &messages);
    let run = recorded(&timeline(&bag), "bag", &fallback).unwrap().remove(0);
    let figures = run.motions[0].figures;
    assert!((figures.effort - 250.0 * 1e-6 / 4e-3).abs() < 1e-3, "the sum of Δq²/Δt: {figures:?}");
    assert!((figures.peak_joint_speed - 0.25).abs() < 1e-9, "{figures:?}");
}

fn figure(run: &RecordedRun, name: &str) -> Figure {
    plot(std::slice::from_ref(run)).unwrap().into_iter().find(|figure| figure.name == name).unwrap()
}

/// How many lines in the colours of the demo's laws a figure has.
fn lines(run: &RecordedRun, name: &str) -> usize {
    let colored = |line: &&str| line.contains("#D55E00") || line.contains("#0072B2");
    figure(run, name).svg.lines().filter(|line| line.contains("<polyline")).filter(colored).count()
}

/// The longest line between two points of the path \[m\].
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
fn a_jump_of_the_robot_or_of_its_tool_is_no_way() {
    let directory = tempfile::tempdir().unwrap();
    let whole = only_run(Path::new(DEMO));
    let middle = first_goal(&read(Path::new(DEMO))) + 2 * SECOND;
    let reset = directory.path().join("reset");
    with_joint_states(&reset, |time, state| state.position[0] += if time > middle { 1.0 } else { 0.0 });
    let reset = only_run(&reset);
    assert!(longest_step(&whole) < 0.05 && longest_step(&reset) < 0.05, "{}", longest_step(&reset));
    assert_eq!(lines(&reset, "joint_positions"), lines(&whole, "joint_positions") + 6);
    let mut messages = read(Path::new(DEMO));
    for message in messages.iter_mut().filter(|message| message.topic == "/parameter_events") {
        alter(message, |event: &mut ParameterEvent| {
            let offset = vec![0.0, 0.0, 0.2, 0.0, 0.0, 0.0, 1.0];
            let mut parameter =
                Parameter { name: "tool_offset".to_owned(), ..event.changed_parameters[0].clone() };
            (parameter.value.kind, parameter.value.double_array_value) = (8, offset);
            event.changed_parameters.push(parameter);
        });
    }
    let tool = directory.path().join("tool");
    write(&tool, WriterOptions::default(), &messages);
    assert!(longest_step(&only_run(&tool)) < 0.05);
}

#[test]
fn a_time_without_a_goal_has_no_pose_error() {
    let whole = only_run(Path::new(DEMO));
    let mut stopped = whole.clone();
    stopped.samples[300..400].iter_mut().for_each(|sample| sample.error = None);
    assert_eq!(lines(&stopped, "pose_error"), lines(&whole, "pose_error") + 2, "one in each panel");
}

/// A chunk of the bag is lost in the midst of the first motion.
#[test]
fn commands_after_a_gap_are_not_judged_until_the_arm_rests() {
    let directory = tempfile::tempdir().unwrap();
    let bag = directory.path().join("gap");
    let goal = first_goal(&read(Path::new(DEMO)));
    let lost = goal + SECOND..goal + SECOND + SECOND / 5;
    demo_without(&bag, |message| lost.contains(&message.time) && message.topic != "/joint_states");
    let (gap, whole) = (replay_demo(&bag), replay_demo(Path::new(DEMO)));
    assert_eq!(gap.different, 0, "{gap:?}");
    assert!(gap.inputs_missing > 0 && gap.not_judged > 100 && gap.judged_s.len() == 2, "{gap:?}");
    assert!(gap.commands + gap.not_judged < whole.commands, "{gap:?}");
    let output = Command::cargo_bin("dq_servo").unwrap().arg("replay").arg(&bag).output().unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success() && said.contains("commands follow"), "{said}");
}

/// The clock of the cycle goes on where only the servo was started again.
#[test]
fn of_a_servo_that_was_started_again_the_last_life_is_replayed() {
    let directory = tempfile::tempdir().unwrap();
    let bag = directory.path().join("twice");
    let mut messages = read(Path::new(DEMO));
    let lasts = messages.last().unwrap().time - messages[0].time + SECOND;
    let mut later = messages.clone();
    for message in &mut later {
        message.time += lasts;
        if message.topic == "/forward_velocity_controller/commands" {
            alter(message, |command: &mut Float64MultiArray| {
                let mut label = CycleLabel::of(command).unwrap();
                label.now += Duration::from_nanos(lasts.unsigned_abs());
                *command = command_array(command.data.clone(), &label.to_string());
            });
        }
    }
    messages.append(&mut later);
    write(&bag, WriterOptions::default(), &messages);
    let (twice, once) = (replay_demo(&bag), replay_demo(Path::new(DEMO)));
    // Other times round otherwise.
    assert!(twice.commands == once.commands && twice.largest_difference < 1e-6, "{twice:?}");
    assert_eq!(twice.not_judged, once.not_judged + once.commands, "{twice:?}");
}
