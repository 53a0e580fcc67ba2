//! Tests the analysis of bags: their runs, and one clear line for bags without a run.

use crate::bags::{
    DEMO, EVENTS, Sample, alter, alter_cycles, altered, cycles_of, demo, demo_with, demo_without, dq_servo,
    jazzy, place, read, samples, write,
};
use crate::interop::peer_samples;
use dq_bags::{Bag, WriterOptions};
use dq_config::ServoParameters;
use dq_figures::Width;
use dq_messages::decode;
use dq_messages::messages::{DiagnosticStatus, JointState, KeyValue, Time, UInt8MultiArray};
use dq_messages::{Parameter, ParameterEvent};
use dq_nodes::Prepared;
use dq_params::Value;
use dq_ros::ros::RosArgs;
use dq_runs::{
    GivenGoals, Recorded, RecordedRun, Replayed, RunError, plot, recorded, recorded_toward, replay,
};
use dq_wire::{CycleRecord, Recorded as RecordedEvent};
use std::ffi::OsStr;
use std::path::Path;
use std::time::Duration;

#[path = "../examples/replay_a_bag.rs"]
mod replay_a_bag;

#[test]
fn the_example_explains_and_replays_the_demo() {
    replay_a_bag::main().unwrap();
}

const SECOND: i64 = 1_000_000_000;

/// Returns the parameters of the PUMA 560, for bags without parameters.
pub fn puma560() -> ServoParameters {
    Prepared::<ServoParameters>::new(&RosArgs::default()).unwrap().parameters().clone()
}

pub fn replay_all(bag: &Path) -> Result<Vec<Replayed>, RunError> {
    replay(&mut Bag::open(bag).unwrap())
}

#[track_caller]
pub fn replay_demo(bag: &Path) -> Replayed {
    let mut replayed = replay_all(bag).unwrap();
    assert_eq!(replayed.len(), 1);
    replayed.remove(0)
}

fn runs(bag: &Path) -> Result<Vec<RecordedRun>, RunError> {
    recorded(bag, "bag", &puma560()).map(|recorded| recorded.runs)
}

/// Returns the length of the tool's path \[m\].
fn way(run: &RecordedRun) -> f64 {
    let points: Vec<_> = run.samples.iter().map(|sample| sample.pose.translation()).collect();
    points.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum()
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
        let commands = run.commands[0].velocities.len();
        assert_eq!((run.samples.len(), commands, run.parameters_known), (800, 800, false));
        // This is the reference work's motion, diffc with K = 185 held for 10 ms each, except for the first steps, which jump.
        assert!((way(&run) / 0.7001 - 1.0).abs() < 0.03, "{}", way(&run));
        assert!(run.motions.is_empty(), "it is of a program that says none");
        let figures = plot(&[run]);
        let names: Vec<_> = figures.iter().map(|figure| figure.name.as_str()).collect();
        assert_eq!(names, ["joint_positions", "joint_velocities", "path", "singular_value"]);
    }
}

#[test]
fn a_bag_written_by_rosbags_with_foreign_topics_is_explained_the_same_way() {
    let directory = tempfile::tempdir().unwrap();
    let original = jazzy(directory.path(), "mcap");
    let of_original = only_run(&original);
    for kind in ["mcap", "sqlite3"] {
        let copy = directory.path().join(format!("copy_{kind}"));
        let messages = peer_samples(&["copy", original.to_str().unwrap(), copy.to_str().unwrap(), kind]);
        assert_eq!(messages.len(), read(&original).len() + 100, "a hundred of another topic");
        let of_copy = only_run(&copy);
        assert_eq!((of_copy.samples.len(), way(&of_copy)), (of_original.samples.len(), way(&of_original)));
    }
}

/// The regression test of the cycle: it still computes the same commands. The bag was made by `dq_servo demo --record … --ros-args
/// -p update_rate:=100`. It must be replaced if the cycle is changed on purpose.
#[test]
fn a_run_of_old_replays() {
    let servo = replay_demo(Path::new(DEMO));
    assert!(servo.commands > 800 && servo.inputs_missing == 0, "{servo:?}");
    // Sines and cosines of another C library may differ in the last bit.
    assert!(servo.largest_difference < 1e-9, "{servo:?}");
}

/// The machine paused for 0.4 s while `bag_late` was recorded, and many messages arrived late. The demo printed path lengths of
/// 0.633 and 0.701 m.
#[test]
fn late_messages_are_not_detours() {
    let run = only_run(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/bag_late")));
    assert!((way(&run) - (0.633 + 0.701)).abs() < 4e-3, "{}", way(&run));
}

#[test]
fn one_bit_of_one_command_is_a_difference_and_so_is_one_of_what_came() {
    let directory = tempfile::tempdir().unwrap();
    let original = replay_demo(Path::new(DEMO));
    let altered = |name: &str, change: fn(&mut CycleRecord)| {
        let mut messages = demo();
        let sends = |message: &&mut Sample| message.topic == EVENTS;
        let mut records: Vec<_> = messages.iter_mut().filter(sends).collect();
        let middle = records.len() / 2;
        alter_cycles(records[middle], |cycles| change(&mut cycles[0]));
        write(&directory.path().join(name), WriterOptions::default(), &messages);
        replay_demo(&directory.path().join(name))
    };
    let sent = altered("sent", |record| {
        let last = record.output.as_mut().unwrap().last_mut().unwrap();
        *last = f64::from_bits(last.to_bits() ^ 1);
    });
    assert_eq!(sent.different.abs_diff(original.different), 1, "{sent:?}, {original:?}");
    // One measurement affects many commands.
    let measured = altered("measured", |record| {
        for event in &mut record.events {
            if let RecordedEvent::JointState { positions, .. } = event {
                let last = positions.to_mut().last_mut().unwrap();
                *last = f64::from_bits(last.to_bits() ^ 1 << 30);
            }
        }
    });
    assert!(measured.different > original.different, "{measured:?}");
}

/// The demo printed the time at which its servo reached the goal.
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
        assert!(closest < 0.05, "{arrived}: {settled:?}");
    }
}

/// The servo is restarted with other parameters before the second goal.
#[test]
fn each_life_of_a_servo_has_its_own_parameters() {
    let directory = tempfile::tempdir().unwrap();
    let original = only_run(Path::new(DEMO));
    let restarted = |name: &str, given: &[(&str, Value)]| {
        let mut messages = demo();
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
            ("limits.joint_velocity", Value::DoubleArray(vec![0.3; 6])),
            ("damping.threshold", Value::Double(0.07)),
            ("tool_offset", Value::DoubleArray(vec![0.0, 0.0, 0.1, 0.0, 0.0, 0.0, 1.0])),
        ],
    );
    let speeds: Vec<_> = run.limits.iter().map(|(_, limits)| limits.joint_velocity[0]).collect();
    assert_eq!(speeds, [original.limits[0].1.joint_velocity[0], 0.3]);
    let again = run.limits[1].0;
    assert!(again > 0.0 && run.motions[1].start_s > again);
    assert_eq!(run.damping_thresholds[1..], [(again, 0.07)]);
    let jumped: Vec<_> =
        run.samples.iter().filter(|sample| sample.jumped).map(|sample| sample.time).collect();
    assert!(jumped.len() == 1 && (again..again + 0.02).contains(&jumped[0]), "another tool: {jumped:?}");
    // The recorded velocity commands are ignored for a robot that takes positions.
    let run = restarted("positions", &[("interface", text("position"))]);
    let commands = &run.commands[0].velocities;
    let last = commands.last().unwrap().0;
    assert!(last <= run.motions[1].start_s && commands.len() > 300, "{last}: {:?}", run.motions);
}

/// Reads the demo's bag with this keep-out (or another parameter) and this reported clearance.
fn among_keep_outs(path: &Path, (name, keep_out): (&str, &str), clearance: &str) -> RecordedRun {
    let mut messages = demo();
    for message in messages.iter_mut().filter(|message| message.topic == "/dq_servo/parameters") {
        alter(message, |event: &mut ParameterEvent| {
            let texts = Value::StringArray(vec![keep_out.to_owned()]);
            let given = [("constraints", Value::Bool(true)), (name, texts)];
            let parameter =
                |(name, value): &(&str, Value)| Parameter { name: (*name).to_owned(), value: value.into() };
            event.new_parameters.retain(|known| given.iter().all(|(name, _)| known.name != *name));
            event.new_parameters.extend(given.iter().map(parameter));
        });
    }
    for message in messages.iter_mut().filter(|message| message.topic == "/dq_servo/status") {
        alter(message, |status: &mut DiagnosticStatus| {
            status.values.push(KeyValue { key: "clearance_m".to_owned(), value: clearance.to_owned() });
        });
    }
    write(path, WriterOptions::default(), &messages);
    only_run(path)
}

#[test]
fn an_arm_that_was_in_what_it_must_keep_out_of_is_named() {
    let directory = tempfile::tempdir().unwrap();
    let whole = only_run(Path::new(DEMO));
    assert!(whole.clearances.is_empty() && whole.inside.is_none());
    // The tool moves from 0.05 m above the base to 0.21 m below it.
    let bag = |name: &str| directory.path().join(name);
    let above = |name: &str, z: f64| {
        among_keep_outs(&bag(name), ("keep_out", &format!("floor half_space 0 0 1 {z}")), "0.03")
    };
    let (away, inside) = (above("away", -2.0), above("inside", -0.1));
    assert_eq!((away.inside.clone(), away.least_clearance()), (None, Some(0.03)));
    let (time, violation) = inside.inside.unwrap();
    assert!(violation.to_string().contains("floor are"), "{violation}");
    assert!(time > 0.0 && time < 5.0, "{time}");
    let left = among_keep_outs(&bag("left"), ("keep_in", "hall half_space 0 0 -1 0.1"), "0.03");
    let (time, violation) = left.inside.clone().unwrap();
    let says = violation.to_string();
    assert!(says.starts_with("the tool is ") && says.ends_with(" mm outside hall"), "{says}");
    assert!(time > 0.0 && time < 5.0, "{time}");
    let post = among_keep_outs(&bag("post"), ("keep_out", "post box -0.1 0.2 0 0.1 0.1 0.4"), "0.03");
    let figures = plot(&[away, left, post]);
    assert!(figures.iter().any(|figure| figure.name == "clearance"));
    let path = figures.iter().find(|figure| figure.name == "path").unwrap();
    let ends = |name: &str| {
        let outlined =
            path.data["scenes"][0]["paths"].as_array().unwrap().iter().filter(|line| line["name"] == name);
        outlined.map(|line| line["points_m"].as_array().unwrap().len()).collect::<Vec<_>>()
    };
    assert!(ends("keep-ins").len() > 5, "lines in the plane of the hall's floor");
    assert_eq!(ends("keep-outs"), [2; 12], "all edges of the box, of the floor far below none");
}

/// The servo's reports of its motions count, even if everything else is missing. A gripper on its own topic causes a warning.
#[test]
fn motions_are_as_the_servo_reported_them() {
    let whole = only_run(Path::new(DEMO)).motions;
    assert_eq!(whole.iter().map(|motion| motion.law.as_str()).collect::<Vec<_>>(), ["logc", "diffc"]);
    assert!(whole.iter().all(|motion| motion.outcome == "arrived" && motion.figures.arrival_time.is_some()));
    let (_directory, bag) = place("bag");
    let mut messages = demo();
    messages.retain(|message| message.topic != "/goal_pose" && !message.topic.ends_with("/commands"));
    let state = messages.iter().find(|message| message.topic == "/joint_states").unwrap();
    let mut gripper = Sample { topic: "/gripper/joint_states".to_owned(), ..state.clone() };
    alter(&mut gripper, |state: &mut JointState| {
        (state.name, state.position) = (vec!["finger".to_owned()], vec![0.1]);
    });
    messages.push(gripper);
    messages.sort_by_key(|message| message.time);
    write(&bag, WriterOptions::default(), &messages);
    let Recorded { runs, warnings, .. } = recorded(&bag, "bag", &puma560()).unwrap();
    let json = |motions: &[_]| serde_json::to_value(motions).unwrap();
    assert_eq!(json(&runs[0].motions), json(&whole));
    assert!(warnings.len() == 1 && warnings[0].contains("gripper"), "{warnings:?}");
}

/// A motion that ended before the recording does not count. A motion that was under way has its true figures.
#[test]
fn a_recording_that_starts_late_has_its_motions_with_all_their_figures() {
    let directory = tempfile::tempdir().unwrap();
    let whole = only_run(Path::new(DEMO)).motions;
    let messages = demo();
    let begin = messages[0].time;
    let first = messages.iter().find(|message| message.topic.ends_with("/motions")).unwrap().time;
    for (name, after, expected) in [("in_motion", SECOND, 2), ("settled", 8 * SECOND, 1)] {
        let cut = first + after;
        let latched =
            |message: &Sample| ["/motions", "/parameters"].iter().any(|end| message.topic.ends_with(end));
        let mut late: Vec<_> =
            messages.iter().filter(|message| message.time >= cut || latched(message)).cloned().collect();
        late.iter_mut().for_each(|message| message.time = message.time.max(cut));
        write(&directory.path().join(name), WriterOptions::default(), &late);
        let motions = only_run(&directory.path().join(name)).motions;
        assert_eq!(motions.len(), expected, "{name}, {begin}: {motions:?}");
        let (last, of_whole) = (motions.last().unwrap().figures, whole[1].figures);
        assert_eq!(last, of_whole);
    }
}

/// Such a bag is, for example, that of an arm that was jogged.
#[test]
fn a_bag_without_goals_is_drawn_and_has_no_motions() {
    let directory = tempfile::tempdir().unwrap();
    let path = |name: &str| directory.path().join(name);
    let of_goals = ["/goal_pose", "/dq_servo/status", "/dq_servo/motions", "/dq_servo/pose_error"];
    demo_without(&path("bag"), |message| of_goals.contains(&message.topic.as_str()));
    let figures = plot(&runs(&path("bag")).unwrap());
    let way = figures.iter().find(|figure| figure.name == "path").unwrap().svg(Width::Screen);
    assert!(way.contains("start") && !way.contains("goal"));
    let speeds = figures.iter().find(|figure| figure.name == "joint_velocities").unwrap();
    assert_eq!(speeds.data["panels"][0]["x"], "time from the beginning [s]");
    let (code, said, _) = dq_servo(&[&"plot", &path("bag"), &"--out", &path("out")]);
    assert!(code == Some(0) && said.starts_with("the bag has no motions"), "{said}");
    assert!(path("out/path.png").exists() && !path("out/pose_error.png").exists());
}

#[test]
fn replay_compares_cycles_with_complete_inputs_and_reports_their_number() {
    let directory = tempfile::tempdir().unwrap();
    let whole = replay_demo(Path::new(DEMO));
    assert_eq!((whole.judged_s.len(), whole.not_judged), (1, 0), "{whole:?}");
    let path = |name: &str| directory.path().join(name);
    // After a missing message in the middle of the first motion, the comparison continues at the next beginning.
    let mut messages = 0;
    let is_gap = |message: &Sample| {
        messages += i32::from(message.topic == EVENTS);
        message.topic == EVENTS && messages == 20
    };
    demo_without(&path("gap"), is_gap);
    let gap = replay_demo(&path("gap"));
    let missing = u64::try_from(cycles_of(&demo()) - cycles_of(&read(&path("gap")))).unwrap();
    assert_eq!((gap.different, gap.inputs_missing, gap.judged_s.len()), (0, missing, 2), "{gap:?}");
    assert!(missing > 5 && gap.commands > 200 && gap.not_judged > 100, "{gap:?}");
    assert_eq!(gap.commands + gap.not_judged + missing, whole.commands);
    let (code, said, _) = dq_servo(&[&"replay", &path("gap")]);
    assert!(code == Some(0) && said.contains("compared: 0.000 to"), "{said}");
    let skipped = format!("{missing} cycles are not in the bag, and {} commands", gap.not_judged);
    assert!(said.contains(&skipped), "{said}");
    // A damaged message counts as missing.
    let mut messages = demo();
    let mut records = messages.iter_mut().filter(|message| message.topic == EVENTS);
    alter(records.nth(19).unwrap(), |record: &mut UInt8MultiArray| record.data.truncate(20));
    write(&path("damaged"), WriterOptions::default(), &messages);
    let damaged = replay_demo(&path("damaged"));
    assert_eq!((damaged.inputs_missing, damaged.damaged), (missing, 1), "{damaged:?}");
    assert_eq!(damaged.commands, gap.commands, "{damaged:?}");
    assert!(dq_servo(&[&"replay", &path("damaged")]).1.contains("1 messages are damaged"));
    // The record alone is sufficient.
    demo_without(&path("alone"), |message| message.topic != EVENTS);
    let alone = replay_demo(&path("alone"));
    assert_eq!((alone.commands, alone.different), (whole.commands, whole.different), "{alone:?}");
}

/// There are two recordings in one bag, interleaved or one after the other: each cycle counts once.
#[test]
fn cycles_that_are_in_a_bag_twice_are_compared_once_and_named() {
    let directory = tempfile::tempdir().unwrap();
    let once = replay_demo(Path::new(DEMO));
    let cycles = u64::try_from(cycles_of(&demo())).unwrap();
    let length = demo().last().unwrap().time - demo()[0].time + SECOND;
    for (name, later) in [("overlapping", 1), ("appended", length)] {
        let bag = directory.path().join(name);
        let mut messages = demo();
        let mut again = messages.clone();
        again.iter_mut().for_each(|message| message.time += later);
        messages.append(&mut again);
        messages.sort_by_key(|message| message.time);
        write(&bag, WriterOptions::default(), &messages);
        let twice = replay_demo(&bag);
        assert_eq!((twice.commands, twice.different), (once.commands, once.different), "{twice:?}");
        assert_eq!((twice.repeated, twice.motions.len()), (cycles, once.motions.len()), "{twice:?}");
        let (code, said, _) = dq_servo(&[&"replay", &bag]);
        assert!(code == Some(0) && said.contains(&format!("{cycles} cycles are in the bag twice")), "{said}");
    }
}

/// A servo that was restarted counts its cycles from the start again.
#[test]
fn a_restarted_servo_is_compared_again() {
    let (_directory, bag) = place("twice");
    let mut messages = demo();
    let lasts = messages.last().unwrap().time - messages[0].time + SECOND;
    let mut later = messages.clone();
    for message in &mut later {
        message.time += lasts;
        if message.topic == EVENTS {
            let much = Duration::from_nanos(lasts.unsigned_abs());
            alter_cycles(message, |cycles| cycles.iter_mut().for_each(|cycle| cycle.now += much));
        }
    }
    messages.append(&mut later);
    write(&bag, WriterOptions::default(), &messages);
    let (twice, once) = (replay_demo(&bag), replay_demo(Path::new(DEMO)));
    assert_eq!((twice.repeated, twice.judged_s.len()), (0, 2), "{twice:?}");
    assert!(twice.commands == 2 * once.commands && twice.motions.len() == 2 * once.motions.len());
}

/// Writes the demo's bag with changes to the cycles of each message.
fn with_cycles(path: &Path, mut change: impl FnMut(&mut Vec<CycleRecord>)) {
    demo_with(path, |samples| {
        let records = samples.iter_mut().filter(|sample| sample.topic == EVENTS);
        records.for_each(|sample| alter_cycles(sample, &mut change));
    });
}

/// If no command was compared, the result is a failure.
#[test]
fn a_bag_of_which_no_command_can_be_compared_says_why_and_fails() {
    let directory = tempfile::tempdir().unwrap();
    let path = |name: &str| directory.path().join(name);
    let is_beginning = |event: &RecordedEvent| matches!(event, RecordedEvent::Begin(..));
    with_cycles(&path("late"), |cycles| {
        let begins = |cycle: &&mut CycleRecord| cycle.events.iter().any(is_beginning);
        cycles.iter_mut().filter(begins).for_each(|cycle| drop(cycle.events.drain(..2)));
    });
    with_cycles(&path("silent"), |cycles| cycles.retain(|cycle| cycle.output.is_none()));
    // This recorder keeps one message and is too slow.
    with_cycles(&path("cut"), |cycles| cycles.truncate(1));
    demo_without(&path("blind"), |message| message.topic == EVENTS);
    altered::<UInt8MultiArray>(&path("other"), |record| record.data.truncate(record.data.len() - 1));
    for (name, needle) in [
        ("late", "no beginning of it is in the bag"),
        ("silent", "sent no command"),
        ("cut", "cycles are missing before each of its"),
        ("blind", "no record of"),
        ("other", "damaged, or of another version"),
    ] {
        let (code, said, why) = dq_servo(&[&"replay", &path(name)]);
        assert!(code == Some(2) && said.is_empty() && why.contains(needle), "{name}: {said}{why}");
        assert_eq!(why.lines().count(), 1, "{why}");
        assert_eq!(only_run(&path(name)).motions.len(), 2);
    }
}

/// The replay creates the same motions that the servo reported, even if the bag lacks the reports. A second servo without a
/// beginning of its record does not prevent this.
#[test]
fn replay_makes_the_motions_of_a_bag_that_does_not_have_them() {
    let (_directory, bag) = place("bag");
    let mut messages = demo();
    messages.retain(|message| message.topic != "/dq_servo/motions");
    let last = messages.iter().rfind(|message| message.topic == EVENTS).unwrap();
    let other = Sample { topic: format!("/other{EVENTS}"), ..last.clone() };
    messages.push(Sample { time: messages.last().unwrap().time, ..other });
    write(&bag, WriterOptions::default(), &messages);
    let replayed = replay_all(&bag).unwrap();
    let [servo, other] = replayed.as_slice() else { panic!("{replayed:?}") };
    assert!(other.why_not.as_ref().is_some_and(|why| why.contains("/other/dq_servo")), "{other:?}");
    let told = only_run(Path::new(DEMO)).motions;
    assert_eq!(servo.motions.len(), told.len());
    for (made, told) in servo.motions.iter().zip(&told) {
        assert_eq!((&made.law, &made.gains, &made.outcome), (&told.law, &told.gains, &told.outcome));
        let lengths = [made, told].map(|motion| motion.figures.path_length);
        assert!((lengths[0] - lengths[1]).abs() < 1e-9, "{lengths:?}");
    }
    let (code, said, _) = dq_servo(&[&"replay", &"--motions", &bag]);
    assert!(code == Some(0) && said.contains("0 differ") && said.contains("diffc"), "{said}");
}

#[test]
fn invalid_runs_are_reported() {
    let directory = tempfile::tempdir().unwrap();
    let path = |name: &str| directory.path().join(name);
    let strangers: Vec<_> =
        samples(1).into_iter().filter(|sample| !sample.message.ends_with("JointState")).collect();
    write(&path("strangers"), WriterOptions::default(), &strangers);
    assert!(matches!(runs(&path("strangers")), Err(RunError::NoRobot(_))));
    let jazzy = jazzy(directory.path(), "mcap");
    let told = replay_all(&jazzy).unwrap_err().to_string();
    assert!(told.contains("~/events was not recorded"), "{told}");
    std::fs::write(path("empty"), "").unwrap();
    let none = concat!(env!("CARGO_MANIFEST_DIR"), "/README.md");
    for (command, bags, needle) in [
        ("plot", vec![Path::new("nothing")], "nothing"),
        ("plot", vec![&path("empty")], "empty"),
        ("plot", vec![Path::new(none)], "README.md"),
        ("plot", vec![&jazzy, &path("strangers")], "joint_states"),
        ("replay", vec![&jazzy], "~/events"),
        ("replay", vec![&path("empty")], "empty"),
    ] {
        let bags = bags.iter().map(|bag| bag as &dyn AsRef<OsStr>);
        let (code, _, told) =
            dq_servo(&[&command as &dyn AsRef<OsStr>].into_iter().chain(bags).collect::<Vec<_>>());
        assert!(code == Some(2) && told.lines().count() == 1 && told.contains(needle), "{command}: {told}");
    }
}

/// Writes the demo's bag as another controller would leave it: joint states, and goals on `/target_pose`. Its arm is the PUMA 560.
fn of_another_controller(path: &Path) {
    demo_with(path, |samples| {
        samples.retain(|sample| ["/joint_states", "/goal_pose"].contains(&&*sample.topic));
        for sample in samples.iter_mut().filter(|sample| sample.topic == "/goal_pose") {
            "/target_pose".clone_into(&mut sample.topic);
        }
    });
}

#[test]
fn the_motions_of_another_controller_are_measured_toward_its_goals() {
    let folder = tempfile::tempdir().unwrap();
    let bag = folder.path().join("bag");
    of_another_controller(&bag);
    assert!(runs(&bag).unwrap()[0].motions.is_empty());
    let topic = GivenGoals::Topic("/target_pose".to_owned());
    let measured = recorded_toward(&bag, "bag", &puma560(), Some(&topic)).unwrap().runs.remove(0);
    let reported = only_run(Path::new(DEMO));
    assert_eq!(measured.motions.len(), 2);
    for (measured, reported) in measured.motions.iter().zip(&reported.motions) {
        assert_eq!(measured.outcome, reported.outcome);
        let (ours, theirs) = (measured.figures, reported.figures);
        let near = |one: Option<f64>, other: Option<f64>| (one.unwrap() - other.unwrap()).abs() < 0.05;
        assert!(near(ours.settling_time_position, theirs.settling_time_position), "{ours:?} {theirs:?}");
        assert!(near(ours.settling_time_rotation, theirs.settling_time_rotation), "{ours:?} {theirs:?}");
        assert!((ours.path_length / theirs.path_length - 1.0).abs() < 0.01, "{ours:?} {theirs:?}");
        assert!((ours.effort / theirs.effort - 1.0).abs() < 0.1, "{ours:?} {theirs:?}");
        assert!((ours.overshoot - theirs.overshoot).abs() < 1e-3, "{ours:?} {theirs:?}");
    }
    assert!(!measured.errors.is_empty());
    // The last goal alone: one motion, from the first joint state on.
    let goal = measured.motions[1].goal.unwrap().map(|number| number.to_string());
    let out = folder.path().join("plots");
    let arguments: [&dyn AsRef<OsStr>; 5] = [&"plot", &bag, &"--json", &"--out", &out];
    let numbers = goal.iter().map(|number| number as &dyn AsRef<OsStr>);
    let (code, stdout, stderr) = dq_servo(
        &arguments.into_iter().chain([&"--goal" as &dyn AsRef<OsStr>]).chain(numbers).collect::<Vec<_>>(),
    );
    assert_eq!(code, Some(0), "{stderr}");
    let motions: serde_json::Value = serde_json::from_str(&stdout).unwrap();
    assert_eq!(motions.as_array().unwrap().len(), 1);
    assert_eq!(motions[0]["outcome"], "arrived");
}

#[test]
fn a_goal_topic_without_goals_is_an_error_that_names_the_others() {
    let folder = tempfile::tempdir().unwrap();
    let (bag, out) = (folder.path().join("bag"), folder.path().join("plots"));
    of_another_controller(&bag);
    let (code, _, stderr) = dq_servo(&[&"plot", &bag, &"--out", &out, &"--goal", &"goal_pose"]);
    assert_eq!(code, Some(2), "{stderr}");
    assert!(stderr.contains("/goal_pose is a goal; the bag has /target_pose"), "{stderr}");
    let (code, _, stderr) = dq_servo(&[&"plot", &bag, &"--out", &out, &"--goal", &"1", &"2"]);
    assert_eq!(code, Some(2), "{stderr}");
    assert!(stderr.contains("seven numbers"), "{stderr}");
}
