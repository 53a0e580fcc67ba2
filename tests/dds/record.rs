//! Tests `dq_servo record` over DDS.

use crate::host::{FAR, Host, assert_success, wait_until};
use crate::replay::place;
use dq_bags::{Bag, BagMessage, Topic};
use dq_messages::decode;
use dq_messages::messages::{Float64MultiArray, JointState};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime, UNIX_EPOCH};
use tempfile::TempDir;

/// Records `host` with these additional arguments. Returns the bag, and the folder, which is deleted with the test.
fn recording(host: &mut Host, more: &[&str]) -> (TempDir, PathBuf) {
    let (directory, bag) = place();
    host.start("recorder", &[&["record", "--out", bag.to_str().unwrap()], more].concat());
    (directory, bag)
}

/// Waits until a bag that is being written has messages of the topic for `seconds`.
#[track_caller]
pub fn wait_for(bag: &Path, topic: &str, seconds: f64) {
    wait_until(|| (bag.exists() && span(&messages(bag, topic)) >= seconds).then_some(()));
}

fn messages(bag: &Path, topic: &str) -> Vec<BagMessage> {
    let bag = Bag::open(bag).ok().into_iter().flatten();
    bag.filter(|message| &*message.topic == topic).collect()
}

/// Returns the topics of a bag, and its losses.
pub fn summary(path: &Path) -> (Vec<Topic>, Vec<String>) {
    let mut bag = Bag::open(path).unwrap();
    bag.by_ref().for_each(drop);
    (bag.topics(), bag.losses().lines().collect())
}

/// Returns the time from the first to the last message \[s\].
fn span(messages: &[BagMessage]) -> f64 {
    let (Some(first), Some(last)) = (messages.first(), messages.last()) else { return -1.0 };
    Duration::from_nanos((last.log_time - first.log_time).unsigned_abs()).as_secs_f64()
}

#[test]
fn a_run_of_servo_and_plant_is_recorded_with_all_its_topics() {
    let mut host = Host::with_both_nodes();
    let (_directory, path) = recording(&mut host, &[]);
    // Latched messages reach late joiners.
    wait_for(&path, "/joint_states", 0.0);
    assert_success(&host.run(&["param", "set", "controller", "diffc"]));
    host.output(&FAR);
    let (code, printed) = host.interrupt("recorder");
    let (topics, losses) = summary(&path);
    let all: u64 = topics.iter().map(|topic| topic.count).sum();
    let told = format!(
        "recorded {all} messages of {} topics in {} (files: 1, dropped: 0)\n",
        topics.len(),
        path.display()
    );
    assert_eq!((code, printed), (Some(0), told));
    assert_eq!(losses, [""; 0]);
    let count = |name: &str| topics.iter().find(|topic| topic.name == name).map_or(0, |topic| topic.count);
    for (name, at_least) in [
        ("/joint_states", 100),
        ("/forward_velocity_controller/commands", 100),
        ("/dq_servo/current_pose", 20),
        ("/dq_servo/pose_error", 20),
        ("/dq_servo/status", 10),
        ("/diagnostics", 1),
        ("/parameter_events", 1),
        ("/dq_servo/parameters", 1),
        ("/dq_servo/events", 10),
        ("/puma560/parameters", 1),
        ("/rosout", 1),
        ("/goal_pose", 1),
        ("/robot_description", 1),
        ("/tf", 10),
        ("/tf_static", 1),
    ] {
        assert!(count(name) >= at_least, "{name}: {}", count(name));
    }
    // The message consists of the header of CDR, an empty layout, the number of speeds with padding, and six speeds.
    let commands = messages(&path, "/forward_velocity_controller/commands");
    assert!(commands.iter().all(|command| command.cdr.len() == 4 + 16 + 48), "{:?}", commands[0].cdr);
    let states = messages(&path, "/joint_states");
    let stamps: Vec<_> = states.iter().map(|state| state.cdr[4..12].to_vec()).collect();
    assert!(stamps.windows(2).all(|pair| pair[0] != pair[1]), "each once");
    // Poses and errors have the stamps of the joint states from which they were computed. The first ones are older than the bag.
    for topic in ["/dq_servo/current_pose", "/dq_servo/pose_error"] {
        let of = messages(&path, topic);
        let matched = of.iter().filter(|pose| stamps.contains(&pose.cdr[4..12].to_vec())).count();
        assert!(matched + 5 >= of.len() && matched > 20, "{topic}: {matched} of {}", of.len());
    }
    // No message was dropped, even if the arm reports often on a busy machine. Each message is logged with its time of arrival.
    for state in &states {
        let stamp = state.decode::<JointState>().unwrap().header.stamp.nanoseconds();
        let late = Duration::from_nanos((state.log_time - stamp).try_into().unwrap());
        assert!(late < Duration::from_secs(1), "logged {late:?} after its stamp");
    }
    let goal = &messages(&path, "/goal_pose")[0];
    let number = |at: usize| f64::from_le_bytes(goal.cdr[at..at + 8].try_into().unwrap());
    let length = goal.cdr.len();
    let orientation_w = number(length - 8);
    assert_eq!((number(length - 56), orientation_w), (-0.125, 1.0));
}

#[test]
fn a_killed_recorder_leaves_all_but_the_last_second() {
    let mut host = Host::with_both_nodes();
    let (_directory, path) = recording(&mut host, &[]);
    wait_for(&path, "/joint_states", 2.0);
    let killed = SystemTime::now().duration_since(UNIX_EPOCH).unwrap();
    host.kill("recorder");
    let (topics, losses) = summary(&path);
    assert_eq!(losses, [""; 0], "it is whole to any reader");
    let metadata = std::fs::read_to_string(path.join("metadata.yaml")).unwrap();
    assert!(topics.iter().all(|topic| metadata.contains(&format!("name: {}\n", topic.name))), "{metadata}");
    for topic in ["/joint_states", "/dq_servo/current_pose"] {
        let last = messages(&path, topic).last().unwrap().log_time;
        let lost = killed.saturating_sub(Duration::from_nanos(last.unsigned_abs()));
        assert!(lost < Duration::from_secs(1), "{topic}: {lost:?}");
    }
}

#[test]
fn named_topics_alone_are_recorded_from_any_namespace_into_as_many_files_as_asked() {
    let mut host = Host::with_both_nodes();
    let more = ["--max-duration", "0.5", "--ros-args", "-r", "states:=joint_states"];
    let topics = ["--topics", "states", "/tf_static", "/dq_servo/no_such_topic"];
    let (_directory, path) = recording(&mut host, &[&topics[..], &more].concat());
    wait_for(&path, "/joint_states", 1.2);
    // `timeout` also sends two signals at once, which count as one.
    let recorder = host.pid("recorder");
    host.shell(&format!("kill -TERM {recorder}; kill -INT {recorder}"));
    assert_eq!(host.wait("recorder"), Some(0));
    let said = host.errors("recorder");
    assert!(
        said.contains("/dq_servo/no_such_topic is not in the bag")
            && said.matches("not in the bag").count() == 1
    );
    let (topics, _) = summary(&path);
    let names: Vec<_> = topics.iter().map(|topic| topic.name.as_str()).collect();
    assert_eq!(names, ["/joint_states", "/tf_static"]);
    assert!(path.join("run_2.mcap").exists());
    let times: Vec<_> = messages(&path, "/joint_states").iter().map(|state| state.log_time).collect();
    let gap = times.windows(2).map(|pair| pair[1] - pair[0]).max().unwrap();
    assert!(gap < 400_000_000, "a file of 0.5 s is missing: {gap} ns");
}

#[test]
fn best_effort_and_unknown_topics_of_another_vendor() {
    let mut host = Host::new();
    host.start_peer(&["record_me"]);
    let (_directory, path) = recording(&mut host, &["--topics", "/lossy", "/latched", "/strange"]);
    let unknown = "/strange: type geometry_msgs/msg/Strange has no definition";
    crate::host::wait_for_line(host.child("recorder"), unknown);
    wait_for(&path, "/lossy", 1.0);
    // A best-effort datagram may be lost.
    assert!(matches!(host.interrupt("recorder").0, Some(0 | 3)));
    let latched = messages(&path, "/latched");
    assert_eq!(latched.len(), 1);
    assert_eq!(latched[0].cdr[..15], *b"\x00\x01\x00\x00\x07\x00\x00\x00before\x00");
    let lossy = messages(&path, "/lossy");
    assert!(lossy.len() > 5 && lossy.iter().all(|message| message.cdr[4..10] == *b"\x02\0\0\0x\0"));
    assert!(summary(&path).0.iter().all(|topic| topic.name != "/strange"));
}

#[test]
fn an_output_that_cannot_be_written_is_named_in_the_error() {
    let host = Host::new();
    let directory = tempfile::tempdir().unwrap();
    let taken = directory.path().to_str().unwrap();
    for (place, code, named) in
        [(taken, 2, "exists already"), ("/proc/bag", 1, "/proc/bag"), ("/no/such/bag", 1, "/no/such")]
    {
        let output = host.run(&["record", "--out", place]);
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(code), "{message}");
        assert!(message.contains(named) && message.lines().count() == 1, "{message}");
    }
}

#[test]
fn a_full_disk_ends_the_recording_with_an_error_and_what_was_written_is_read() {
    let host = Host::with_both_nodes();
    let (_directory, path) = place();
    // A file size limit replaces a full disk: writes fail in the same way.
    let output = host.run_with_file_limit(&["record", "--out", path.to_str().unwrap()]);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert!(message.contains("cannot write") && message.contains("run_0.mcap"), "{message}");
    assert!(!summary(&path).1.is_empty() && !messages(&path, "/joint_states").is_empty());
}

#[test]
fn a_demo_says_at_once_that_its_recording_has_ended_and_fails_at_its_end() {
    let mut host = Host::new();
    let (_directory, path) = place();
    let demo = host.start("demo", &["demo", "--record", path.to_str().unwrap()]);
    wait_for(&path, "/joint_states", 0.5);
    std::fs::remove_file(path.join("run_0.mcap")).unwrap();
    crate::host::wait_for_line(demo, "the recording has ended: cannot write");
    assert_eq!(host.wait("demo"), Some(1));
}

#[test]
fn a_recorder_that_was_stopped_and_continued_ends_its_bag_and_says_that_it_is_deaf() {
    let mut host = Host::with_both_nodes();
    let (_directory, path) = recording(&mut host, &[]);
    wait_for(&path, "/joint_states", 0.5);
    host.signal("recorder", "STOP");
    std::thread::sleep(Duration::from_millis(300));
    host.signal("recorder", "CONT");
    assert_eq!(host.wait("recorder"), Some(1));
    let said = host.errors("recorder");
    assert!(said.contains("DDS has ended") && said.contains("messages received before"), "{said}");
    assert_eq!(summary(&path).1, [""; 0]);
    assert!(!messages(&path, "/joint_states").is_empty());
}

#[test]
fn an_interrupted_goal_leaves_a_finished_bag_of_remapped_topics() {
    let remaps = ["--ros-args", "-r", "joint_states:=robot/states", "-r", "goal_pose:=/target"];
    let mut host = Host::with_nodes(&remaps, &remaps);
    let (_directory, path) = place();
    host.start("goal", &[&FAR[..], &["--record", path.to_str().unwrap()], &remaps].concat());
    wait_for(&path, "/target", 0.0);
    wait_for(&path, "/robot/states", 0.5);
    assert_eq!(host.interrupt("goal").0, Some(1));
    let (topics, losses) = summary(&path);
    assert_eq!(losses, [""; 0]);
    let count = |name: &str| topics.iter().find(|topic| topic.name == name).map_or(0, |topic| topic.count);
    assert!(count("/target") == 1 && count("/robot/states") > 100, "{topics:?}");
}

#[test]
fn large_messages_take_bounded_memory() {
    let mut host = Host::new();
    let _bag = recording(&mut host, &["--topics", "/large"]);
    host.peer(&["large"]);
    let memory = host.memory("recorder");
    let (code, printed) = host.interrupt("recorder");
    // Messages that the publisher could not send in time are counted.
    assert_eq!(code, Some(if printed.contains("dropped: 0)") { 0 } else { 3 }), "{printed}");
    let numbers: Vec<u64> =
        printed.split(|c: char| !c.is_ascii_digit()).filter_map(|it| it.parse().ok()).collect();
    assert!(numbers[0] > 400 && printed.contains("messages of 1 topics"), "{printed}");
    assert!(memory < 300.0, "{memory} MB of {printed}");
}

#[test]
fn a_topic_that_comes_back_with_another_type_is_not_mixed_up() {
    let mut host = Host::new();
    let (_directory, path) = recording(&mut host, &["--topics", "/changing"]);
    host.peer(&["type", "0"]);
    host.peer(&["type", "1"]);
    assert_eq!(host.interrupt("recorder").0, Some(0));
    let said = host.errors("recorder");
    assert!(said.contains("/changing now has the type std_msgs/msg/Float64MultiArray"), "{said}");
    let all = messages(&path, "/changing");
    assert!(!all.is_empty() && all.iter().all(|message| &*message.message == "std_msgs/msg/String"));
}

/// Returns the last command in the bag.
fn last_command(bag: &Path) -> Vec<f64> {
    let commands = messages(bag, "/forward_velocity_controller/commands");
    let command: Float64MultiArray = decode(&commands.last().unwrap().cdr).unwrap();
    command.data
}

#[test]
fn a_demo_that_loses_its_terminal_brings_the_arm_to_rest_and_finishes_its_bag() {
    let mut host = Host::new();
    let (_directory, path) = place();
    let demo = host.start("demo", &["demo", "--record", path.to_str().unwrap()]);
    crate::host::wait_for_line(demo, "tracking");
    host.signal("demo", "HUP");
    assert_eq!(host.wait("demo"), Some(1));
    assert!(summary(&path).1.is_empty(), "nothing is lost");
    assert_eq!(last_command(&path), [0.0; 6]);
}

#[test]
fn a_recorder_whose_summary_is_not_read_finishes_its_bag_and_ends_at_the_next_signal() {
    let mut host = Host::with_both_nodes();
    let (_directory, path) = place();
    let (_reader, mut held) = std::io::pipe().unwrap();
    held.write_all(&[b'\n'; 65_536]).unwrap();
    host.start_writing_to("recorder", &["record", "--out", path.to_str().unwrap()], held);
    wait_for(&path, "/joint_states", 0.5);
    host.signal("recorder", "QUIT");
    wait_until(|| summary(&path).1.is_empty().then_some(()));
    host.shell("sleep 0.2");
    host.signal("recorder", "TERM");
    assert_eq!(host.wait("recorder"), Some(1));
    assert!(host.errors("recorder").contains("interrupted while stdout was blocked"));
}
