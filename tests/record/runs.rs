//! Bags explained: the runs in them, and one clear line for what is no run.

use crate::bags::{Sample, alter, jazzy, read, samples, write};
use crate::interop::peer_samples;
use assert_cmd::Command;
use dq_servo::config::{DualParameters, ServoParameters};
use dq_servo::nodes::Prepared;
use dq_servo::params::Value;
use dq_servo::record::{Bag, WriterOptions};
use dq_servo::ros::RosArgs;
use dq_servo::runs::{Fallback, RecordedRun, Replayed, RunError, Timeline, plot, recorded, replay};
use dq_servo::wire::messages::{DiagnosticStatus, JointState, Time};
use dq_servo::wire::{ParameterEvent, decode};
use std::path::Path;

/// The PUMA 560's parameters, for bags that do not have theirs.
pub fn puma560() -> Fallback {
    Fallback {
        servo: Prepared::<ServoParameters>::new(&RosArgs::default()).unwrap().parameters().clone(),
        dual: Prepared::<DualParameters>::new(&RosArgs::default()).unwrap().parameters().clone(),
    }
}

pub const DEMO: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/bag_demo");

pub fn timeline(bag: &Path) -> Timeline {
    Timeline::read(Bag::open(bag).unwrap())
}

#[track_caller]
pub fn replay_demo(bag: &Path) -> Replayed {
    let mut replayed = replay(&timeline(bag)).unwrap();
    assert_eq!(replayed.len(), 1);
    replayed.remove(0)
}

fn runs(bag: &Path) -> Result<Vec<RecordedRun>, RunError> {
    recorded(&timeline(bag), "bag", &puma560())
}

#[track_caller]
pub fn only_run(bag: &Path) -> RecordedRun {
    let mut runs = runs(bag).unwrap();
    assert_eq!(runs.len(), 1);
    runs.remove(0)
}

#[test]
fn the_run_of_a_real_ros_2_is_explained_from_either_storage() {
    for storage in ["mcap", "sqlite3"] {
        let directory = tempfile::tempdir().unwrap();
        let run = only_run(&jazzy(directory.path(), storage));
        assert_eq!((run.samples.len(), run.commands.len(), run.parameters_known), (800, 800, false));
        let [motion] = run.motions.as_slice() else { panic!("{:?}", run.motions) };
        // diffc with K = 185, held for 10 ms each: the reference work's motion but for the first steps, which jump.
        assert!((motion.figures.straight_line - 0.5618).abs() < 1e-3, "{motion:?}");
        assert!((motion.figures.path_length / 0.7001 - 1.0).abs() < 0.03, "{motion:?}");
        assert!((1e3 * motion.figures.overshoot - 10.9).abs() < 0.5, "{motion:?}");
        let last = run.samples.last().unwrap();
        assert!((7.4..7.6).contains(&last.time), "{}", last.time);
        assert!((1e3 * motion.figures.position_error - 5.67).abs() < 0.1, "on the way to 3.459 mm at 10 s");
        let figures = plot(&[run]).unwrap();
        let names: Vec<_> = figures.iter().map(|figure| figure.name.as_str()).collect();
        // It does not report the cycle's period.
        assert_eq!(names, ["pose_error", "joint_positions", "joint_velocities", "path", "singular_value"]);
    }
}

#[test]
fn a_bag_that_rosbags_wrote_with_topics_of_others_is_explained_alike() {
    let directory = tempfile::tempdir().unwrap();
    let original = jazzy(directory.path(), "mcap");
    let of_original = only_run(&original).motions;
    for kind in ["mcap", "sqlite3"] {
        let copy = directory.path().join(format!("copy_{kind}"));
        let messages = peer_samples(&["copy", original.to_str().unwrap(), copy.to_str().unwrap(), kind]);
        assert_eq!(messages.len(), read(&original).len() + 100, "a hundred of another topic");
        let of_copy = only_run(&copy).motions;
        assert_eq!(of_copy.len(), 1);
        assert_eq!(serde_json::to_value(&of_copy).unwrap(), serde_json::to_value(&of_original).unwrap());
    }
}

/// The regression test of the cycle: what it once commanded it commands today. The bag is of `dq_servo demo --record … --ros-args
/// -p update_rate:=100`; where the cycle is changed on purpose it has to be made anew.
#[test]
fn a_run_of_old_replays() {
    let servo = replay_demo(Path::new(DEMO));
    assert!(servo.commands > 800 && servo.inputs_missing == 0, "{servo:?}");
    // Sines and cosines of another C library may differ in their last bit.
    assert!(servo.largest_difference < 1e-9, "{servo:?}");
}

/// The machine stood for 0.4 s when `bag_late` was recorded, and many messages came late. The demo printed 0.633 and 0.701 m.
#[test]
fn messages_that_came_late_are_no_detours() {
    let run = only_run(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/bag_late")));
    let lengths: Vec<_> = run.motions.iter().map(|motion| motion.figures.path_length).collect();
    assert!((lengths[0] - 0.633).abs() < 2e-3 && (lengths[1] - 0.701).abs() < 2e-3, "{lengths:?}");
}

#[test]
fn one_bit_of_one_command_is_a_difference() {
    let directory = tempfile::tempdir().unwrap();
    let mut messages = read(Path::new(DEMO));
    let mut commands: Vec<_> = messages
        .iter_mut()
        .filter(|message| message.topic == "/forward_velocity_controller/commands")
        .collect();
    let middle = commands.len() / 2;
    let bytes = &mut commands[middle].cdr;
    // The lowest bit of the last joint's speed.
    let last_number = bytes.len() - 8;
    bytes[last_number] ^= 1;
    write(&directory.path().join("bag"), WriterOptions::default(), &messages);
    let (altered, original) = (replay_demo(&directory.path().join("bag")), replay_demo(Path::new(DEMO)));
    assert_eq!(altered.different.abs_diff(original.different), 1, "{altered:?}, {original:?}");
}

/// The demo ends by a stop, before which the same goal would only have moved the aim.
#[test]
fn a_goal_that_was_dropped_begins_another_motion_when_it_comes_again() {
    for (stopped, expected) in [(false, 2), (true, 3)] {
        let directory = tempfile::tempdir().unwrap();
        let mut messages = read(Path::new(DEMO));
        let goal = messages.iter().rposition(|message| message.topic == "/goal_pose").unwrap();
        let again = messages[goal].cdr.clone();
        let time =
            if stopped { messages.last().unwrap().time + 1 } else { messages[goal].time + 100_000_000 };
        let place = messages.partition_point(|message| message.time <= time);
        let Sample { topic, message, .. } = &messages[goal];
        let again = Sample { topic: topic.clone(), message: message.clone(), time, cdr: again };
        messages.insert(place, again);
        write(&directory.path().join("bag"), WriterOptions::default(), &messages);
        let run = only_run(&directory.path().join("bag"));
        assert_eq!(run.motions.len(), expected, "{:?}", run.motions);
    }
}

/// Shortly before the second goal the robot is elsewhere, and the servo holds.
#[test]
fn a_motion_ends_where_the_robot_still_was_what_it_moved() {
    let directory = tempfile::tempdir().unwrap();
    let mut messages = read(Path::new(DEMO));
    let goal = messages.iter().rposition(|message| message.topic == "/goal_pose").unwrap();
    let before = messages[goal].time - 150_000_000;
    for message in messages[..goal].iter_mut().filter(|message| message.time > before) {
        match message.topic.as_str() {
            "/joint_states" => alter(message, |state: &mut JointState| state.position[0] += 1.0),
            "/dq_servo/status" => {
                alter(message, |status: &mut DiagnosticStatus| status.message = "holding".to_owned())
            }
            _ => {}
        }
    }
    write(&directory.path().join("bag"), WriterOptions::default(), &messages);
    let (run, original) = (only_run(&directory.path().join("bag")), only_run(Path::new(DEMO)));
    assert_eq!(run.motions.len(), 2);
    let (figures, whole) = (run.motions[0].figures, original.motions[0].figures);
    assert!(
        figures.position_error < 1e-3 && (figures.path_length - whole.path_length).abs() < 1e-3,
        "{figures:?}"
    );
    assert!(figures.elapsed < whole.elapsed && figures.arrival_time == whole.arrival_time, "{figures:?}");
}

/// The demo printed the time at which its servo was at the goal.
#[test]
fn the_arrival_is_when_the_servo_said_so() {
    let run = only_run(Path::new(DEMO));
    let settled: Vec<_> = run.changes.iter().filter(|change| change.to == "settled").collect();
    let arrived: Vec<_> =
        run.motions.iter().map(|motion| motion.start_s + motion.figures.arrival_time.unwrap()).collect();
    assert_eq!(arrived.len(), 2);
    for arrived in arrived {
        let closest =
            settled.iter().map(|change| (change.time - arrived).abs()).fold(f64::INFINITY, f64::min);
        assert!(closest < 0.01, "{arrived}: {settled:?}");
    }
}

/// Before the second goal the servo is started again, with other parameters.
#[test]
fn each_life_of_a_servo_has_its_own_parameters() {
    let directory = tempfile::tempdir().unwrap();
    let original = only_run(Path::new(DEMO));
    let restarted = |name: &str, given: &[(&str, Value)]| {
        let mut messages = read(Path::new(DEMO));
        let goal = messages.iter().rposition(|message| message.topic == "/goal_pose").unwrap();
        let time = messages[goal].time - 20_000_000;
        messages.retain(|message| {
            let changes = |event: ParameterEvent| !event.changed_parameters.is_empty();
            message.topic != "/dq_servo/parameters" || !changes(decode(&message.cdr).unwrap())
        });
        let start = messages.iter().position(|message| message.topic == "/dq_servo/parameters").unwrap();
        let Sample { topic, message, cdr, .. } = &messages[start];
        let mut start = Sample { topic: topic.clone(), message: message.clone(), time, cdr: cdr.clone() };
        alter(&mut start, |event: &mut ParameterEvent| {
            event.stamp = Time { sec: (time / 1_000_000_000) as i32, nanosec: (time % 1_000_000_000) as u32 };
            for (name, value) in given {
                let parameter = event.new_parameters.iter_mut().find(|one| one.name == *name).unwrap();
                parameter.value = value.into();
            }
        });
        let place = messages.partition_point(|message| message.time <= time);
        messages.insert(place, start);
        write(&directory.path().join(name), WriterOptions::default(), &messages);
        only_run(&directory.path().join(name))
    };
    let text = |text: &str| Value::String(text.to_owned());
    let run = restarted(
        "bag",
        &[
            ("controller", text("double_geodesic")),
            ("limits.joint_velocity", Value::DoubleArray(vec![0.3; 6])),
            ("damping.threshold", Value::Double(0.07)),
            ("tool_offset", Value::DoubleArray(vec![0.0, 0.0, 0.1, 0.0, 0.0, 0.0, 1.0])),
        ],
    );
    let laws: Vec<_> = run.motions.iter().map(|motion| motion.law.as_deref().unwrap()).collect();
    assert_eq!(laws, ["logc", "double_geodesic"]);
    let speeds: Vec<_> = run.limits.iter().map(|(_, limits)| limits.joint_velocity[0]).collect();
    assert_eq!(speeds, [original.limits[0].1.joint_velocity[0], 0.3]);
    let again = run.limits[1].0;
    assert!(again > 0.0 && run.motions[1].start_s > again && run.motions[0].figures.arrival_time.is_some());
    assert_eq!(run.damping_thresholds[1..], [(again, 0.07)]);
    let jumped: Vec<_> =
        run.samples.iter().filter(|sample| sample.jumped).map(|sample| sample.time).collect();
    assert!(jumped.len() == 1 && (again..again + 0.02).contains(&jumped[0]), "another tool: {jumped:?}");
    // The commands of speeds that are in the bag are none to a robot that takes positions.
    let run = restarted("positions", &[("command_interface", text("position"))]);
    let last = run.commands.last().unwrap().0;
    assert!(last <= run.motions[1].start_s && run.commands.len() > 300, "{last}: {:?}", run.motions);
}

/// The demo's bag without some of its messages, as `ros2 bag record -a` makes it: it subscribes late.
pub fn demo_without(path: &Path, mut is_missing: impl FnMut(&Sample) -> bool) {
    let mut messages = read(Path::new(DEMO));
    messages.retain(|message| !is_missing(message));
    write(path, WriterOptions::default(), &messages);
}

#[test]
fn goals_that_were_not_recorded_are_taken_from_the_status() {
    let directory = tempfile::tempdir().unwrap();
    let whole = only_run(Path::new(DEMO)).motions;
    for (name, keep) in [("without_any", 0), ("without_the_first", 1)] {
        let bag = directory.path().join(name);
        let mut seen = 0;
        demo_without(&bag, |message| {
            seen += i32::from(message.topic == "/goal_pose");
            message.topic == "/goal_pose" && seen <= 2 - keep
        });
        let motions = only_run(&bag).motions;
        assert_eq!(motions.len(), whole.len(), "{name}");
        for (motion, whole) in motions.iter().zip(&whole) {
            // A status comes within 0.1 s of what it is about.
            assert!(
                (motion.figures.path_length - whole.figures.path_length).abs() < 0.02,
                "{name}: {motion:?}, {whole:?}"
            );
            assert!(
                (1e3 * (motion.figures.position_error - whole.figures.position_error)).abs() < 0.05,
                "{name}: {motion:?}"
            );
        }
    }
}

/// As one is of an arm that was jogged.
#[test]
fn a_bag_without_goals_is_drawn_and_has_no_motions() {
    let directory = tempfile::tempdir().unwrap();
    let path = |name: &str| directory.path().join(name);
    demo_without(&path("bag"), |message| message.topic == "/goal_pose" || message.topic.ends_with("/status"));
    let figures = plot(&runs(&path("bag")).unwrap()).unwrap();
    let way = figures.iter().find(|figure| figure.name == "path").unwrap();
    assert!(way.svg.contains("start") && !way.svg.contains("goal"));
    let speeds = figures.iter().find(|figure| figure.name == "joint_velocities").unwrap();
    assert_eq!(speeds.data["panels"][0]["x"], "time from the beginning [s]");
    let mut plot = Command::cargo_bin("dq_servo").unwrap();
    let output = plot.arg("plot").arg(path("bag")).arg("--out").arg(path("out")).output().unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success() && said.starts_with("no goals"), "{said}");
    assert!(path("out/path.png").exists() && !path("out/pose_error.png").exists());
}

#[test]
fn replay_judges_what_it_has_all_inputs_of_and_says_what_that_is() {
    let directory = tempfile::tempdir().unwrap();
    let whole = replay_demo(Path::new(DEMO));
    assert_eq!(whole.judged_s.len(), 1);
    let path = |name: &str| directory.path().join(name);
    // Without the second goal only the commands before it are judged.
    let mut goals = 0;
    demo_without(&path("late"), |message| {
        goals += i32::from(message.topic == "/goal_pose");
        message.topic == "/goal_pose" && goals == 2
    });
    let late = replay_demo(&path("late"));
    assert_eq!((late.different, late.inputs_missing), (0, 1), "{late:?}");
    assert!(late.commands > 500 && late.not_judged > 300, "{late:?}");
    assert_eq!(late.commands + late.not_judged, whole.commands + whole.not_judged);
    let output = Command::cargo_bin("dq_servo").unwrap().arg("replay").arg(path("late")).output().unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success() && said.contains("judged: 0.000 to"), "{said}");
    // A joint state that is missing in the midst of the first motion ends the comparison there.
    let mut states = 0;
    demo_without(&path("gap"), |message| {
        states += i32::from(message.topic == "/joint_states");
        message.topic == "/joint_states" && states == 300
    });
    let gap = replay_demo(&path("gap"));
    assert!(gap.inputs_missing == 1 && gap.commands > 200 && gap.commands < late.commands, "{gap:?}");
    // Without what the servo started with there is nothing to begin with.
    let states = ["/parameter_events", "/dq_servo/parameters"];
    demo_without(&path("blind"), |message| states.contains(&&*message.topic));
    assert!(matches!(replay(&timeline(&path("blind"))), Err(RunError::NotReplayable(_))));
}

#[test]
fn what_is_no_run_is_told_so() {
    let directory = tempfile::tempdir().unwrap();
    let path = |name: &str| directory.path().join(name);
    let strangers: Vec<_> =
        samples(1).into_iter().filter(|sample| !sample.message.ends_with("JointState")).collect();
    write(&path("strangers"), WriterOptions::default(), &strangers);
    assert!(matches!(runs(&path("strangers")), Err(RunError::NoRobot(_))));
    let jazzy = jazzy(directory.path(), "mcap");
    let told = replay(&timeline(&jazzy)).unwrap_err().to_string();
    assert!(
        told.contains("/parameter_events") && told.contains("ended before a servo had said it"),
        "{told}"
    );
    std::fs::write(path("empty"), "").unwrap();
    for (arguments, needle) in [
        (vec!["plot", "nothing"], "nothing"),
        (vec!["plot", path("empty").to_str().unwrap()], "empty"),
        (vec!["plot", concat!(env!("CARGO_MANIFEST_DIR"), "/README.md")], "README.md"),
        (vec!["plot", jazzy.to_str().unwrap(), path("strangers").to_str().unwrap()], "joint_states"),
        (vec!["replay", jazzy.to_str().unwrap()], "/parameter_events"),
        (vec!["replay", path("empty").to_str().unwrap()], "empty"),
    ] {
        let output = Command::cargo_bin("dq_servo").unwrap().args(&arguments).output().unwrap();
        let told = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {told}");
        assert!(told.lines().count() == 1 && told.contains(needle), "{arguments:?}: {told}");
    }
}
