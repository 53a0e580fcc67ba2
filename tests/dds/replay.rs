//! Tests that runs that were recorded over DDS replay without DDS to the last bit, and tests their plots.

use crate::commands::err;
use crate::host::{FAR, FAST, Host, assert_success, wait_until};
use dq_bags::Bag;
use dq_config::ServoParameters;
use dq_nodes::Prepared;
use dq_ros::ros::RosArgs;
use dq_runs::{Replayed, recorded, replay};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Returns a path for a bag. The bag is deleted with the test.
pub fn place() -> (tempfile::TempDir, PathBuf) {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("run");
    (directory, path)
}

/// Replays a bag with one servo. Returns the number of equal commands.
#[track_caller]
pub fn assert_replays(bag: &Path) -> u64 {
    let servo = replayed(bag);
    assert_eq!((servo.different, servo.inputs_missing), (0, 0), "{servo:?}");
    servo.commands
}

/// Replays the only servo in a bag.
#[track_caller]
fn replayed(bag: &Path) -> Replayed {
    let replayed = replay(&mut Bag::open(bag).unwrap()).unwrap();
    let [servo] = replayed.as_slice() else { panic!("{replayed:?}") };
    servo.clone()
}

/// Records both nodes while another vendor's peer runs these cases. Returns the bag, and the number of commands that replay to the
/// bit.
#[track_caller]
pub fn recorded_and_replayed(cases: &[&str]) -> (tempfile::TempDir, PathBuf, u64) {
    let mut host = Host::with_both_nodes();
    let (directory, bag) = place();
    host.record(&bag);
    crate::record::wait_for(&bag, "/dq_servo/events", 0.0);
    cases.iter().for_each(|case| host.peer_with(&[("READERS", "2")], &[case]));
    assert_eq!(host.interrupt("recorder").0, Some(0));
    let commands = assert_replays(&bag);
    (directory, bag, commands)
}

/// Records the demo. Returns the table that it printed, and the table that `plot` prints for its bag.
fn demo_and_plot(arguments: &[&str], bag: &Path, figures: usize) -> (Vec<Value>, Vec<Value>) {
    let host = Host::new();
    let text = bag.to_str().unwrap();
    let demo = host.output(&[&["demo", "--json", "--record", text], arguments].concat());
    let plots = bag.with_extension("plots");
    let plot = host.output(&["plot", text, "--json", "--out", plots.to_str().unwrap()]);
    assert_eq!(plots.read_dir().unwrap().count(), 2 * figures + 1, "SVG and PNG, and whose they are");
    (serde_json::from_str(&demo).unwrap(), serde_json::from_str(&plot).unwrap())
}

/// Checks that both tables repeat the servo's report.
#[track_caller]
fn assert_alike(told: &Value, plotted: &Value) {
    for key in [
        "settling_time_2_percent_rotation_s",
        "settling_time_2_percent_position_s",
        "arrival_time_s",
        "path_length_m",
        "path_ratio",
        "position_error_m",
        "overshoot_m",
        "peak_joint_speed_rad_s",
        "effort_rad2_s",
        "min_singular_value",
    ] {
        assert!(told[key].is_number() && told[key] == plotted[key], "{key}: {told} {plotted}");
    }
}

#[test]
fn the_demo_moves_there_and_back_under_two_laws_replays_bit_for_bit_and_is_plotted() {
    let (_directory, bag) = place();
    let (told, plotted) = demo_and_plot(&[], &bag, 6);
    assert!(assert_replays(&bag) > 1000);
    assert_eq!((told.len(), plotted.len()), (2, 2));
    for ((motion, plotted), law) in told.iter().zip(&plotted).zip(["logc", "diffc"]) {
        assert_eq!((&motion["law"], &plotted["law"]), (&json!(law), &json!(law)));
        assert_alike(motion, plotted);
        let number = |key: &str| motion[key].as_f64().unwrap_or_else(|| panic!("{key} in {motion}"));
        assert!((number("straight_line_m") - 0.559).abs() < 2e-3);
        assert!(number("path_length_m") >= number("straight_line_m"));
        assert!(number("position_error_m") <= 1e-3 && number("rotation_error_rad") <= 1e-2);
        assert!(number("settling_time_2_percent_s") <= number("arrival_time_s"));
        assert!((0.1..=5.0).contains(&number("peak_joint_speed_rad_s")));
        assert!(number("cycle_jitter_p99_us") <= number("cycle_jitter_max_us"));
    }
    // Across the singularity logc settles in 4.2 s.
    assert!((told[0]["settling_time_2_percent_s"].as_f64().unwrap() - 4.2).abs() < 0.5, "{told:?}");
}

/// The wall is in the path of the arm.
#[test]
fn a_demo_among_keep_outs_replays_bit_for_bit_and_its_distance_is_drawn() {
    let (_directory, bag) = place();
    let keep_out = "keep_out:=['wall half_space 0 -1 0 -0.4']";
    let more = ["--ros-args", "-p", "constraints:=true", "-p", keep_out];
    let _ = demo_and_plot(&more, &bag, 7);
    assert!(assert_replays(&bag) > 1000);
    let servo = Prepared::<ServoParameters>::new(&RosArgs::default()).unwrap();
    let runs = recorded(&bag, "run", servo.parameters()).unwrap().runs;
    let [run] = runs.as_slice() else { panic!("{runs:?}") };
    let least = run.least_clearance().unwrap();
    assert!(run.inside.is_none() && (0.0095..0.02).contains(&least), "{least} {:?}", run.inside);
}

/// The commands of an arm that takes positions are the speeds of these positions, not the motion of the arm; they are lower where cycles
/// were missed. Without a clock all stamps are equal.
#[test]
fn the_demo_of_an_arm_that_takes_positions_in_simulated_time_too() {
    let (_directory, bag) = place();
    let more = ["--ros-args", "-p", "interface:=position", "-p", "use_sim_time:=true"];
    let (told, plotted) = demo_and_plot(&more, &bag, 6);
    assert!(assert_replays(&bag) > 1000);
    for (told, plotted) in told.iter().zip(&plotted) {
        assert_alike(told, plotted);
    }
}

#[test]
fn the_demo_of_two_arms_in_both_forms_too() {
    let (_directory, bag) = place();
    let (told, plotted) = demo_and_plot(&["--dual"], &bag, 6);
    assert!(assert_replays(&bag) > 1000);
    assert_alike(&told[0], &plotted[0]);
    assert_alike(&told[1], plotted.last().unwrap());
    let of = |key: &str| told.iter().map(|motion| motion[key].clone()).collect::<Vec<_>>();
    assert_eq!(of("law"), ["transpose", "damped_inverse"]);
    assert_eq!(of("primitive"), ["relative_position", "relative_pose"]);
    for motion in &told {
        // The distance is from |t_r| to twice |t_r|, and back. When the whole pose is selected, the arms already begin to turn
        // back.
        assert!((motion["straight_line_m"].as_f64().unwrap() - 0.5587).abs() < 0.03, "{motion}");
        assert!(motion["position_error_m"].as_f64().unwrap() <= 1e-3, "{motion}");
    }
    assert!(told[1]["rotation_error_rad"].as_f64().unwrap() <= 1e-2, "{told:?}");
}

#[test]
fn a_goal_is_recorded_from_the_start_with_the_parameters_in_force() {
    let host = Host::with_both_nodes();
    for (name, value) in
        [("controller", "double_geodesic"), ("limits.linear_speed", "0.4"), ("controller", "diffc")]
    {
        assert_success(&host.run(&["param", "set", name, value]));
    }
    let (directory, bag) = place();
    host.output(&[&FAR[..], &["--record", bag.to_str().unwrap()]].concat());
    assert!(assert_replays(&bag) > 100);
    let runs = recorded(&bag, "run", &built_in()).unwrap().runs;
    let [run] = runs.as_slice() else { panic!("{} runs", runs.len()) };
    // RustDDS keeps more samples of a latched topic than its depth, so the bag may have laws from before its beginning.
    let law = run.laws.last().map(|(_, law)| law.as_str());
    assert_eq!((run.parameters_known, law), (true, Some("diffc")));
    // The next motion is recorded while the arm is held at its goal.
    let bag = directory.path().join("next");
    let goal = ["goal", "0.1", "0.3", "0.1", "0", "0", "0", "1", "--record"];
    assert_success(&host.run(&[goal.as_slice(), &[bag.to_str().unwrap()]].concat()));
    assert!(assert_replays(&bag) > 100);
    let plots = directory.path().join("plots");
    let plot = host.output(&["plot", bag.to_str().unwrap(), "--json", "--out", plots.to_str().unwrap()]);
    let motions: Vec<Value> = serde_json::from_str(&plot).unwrap();
    assert!(motions.len() == 1 && motions[0]["path_length_m"].as_f64().unwrap() > 0.1, "{motions:?}");
    assert!(
        motions[0]["arrival_time_s"].as_f64().unwrap() > 1.0 && motions[0]["law"] == "diffc",
        "{motions:?}"
    );
}

/// Why an arm is at rest when a recording begins: it holds an earlier goal, is paused during a motion, or has stalled.
#[derive(Debug)]
enum Rest {
    Settled,
    Paused,
    Stalled,
}

/// Records two motions of an arm that is at rest before, and replays them.
fn assert_replays_from_rest(rest: &Rest) {
    let mut host = Host::with_nodes(
        &[],
        &[&FAST[..3], &["-p", "progress_timeout:=1.0", "-p", "goal_beyond_reach:=approach"]].concat(),
    );
    let goal = |host: &Host, [x, y, z]: [&str; 3]| {
        assert_success(&host.run(&["goal", x, y, z, "0", "0", "0", "1"]));
    };
    let leave = |host: &Host, [x, y, z]: [&str; 3]| {
        let gives_up = ["goal", x, y, z, "0", "0", "0", "1", "--keep-going", "--timeout", "0.6"];
        assert_eq!(host.run(&gives_up).status.code(), Some(1));
    };
    goal(&host, ["-0.125", "0.2", "0.2"]);
    match rest {
        Rest::Settled => {}
        Rest::Paused => {
            leave(&host, ["0.1", "0.3", "0.3"]);
            assert_success(&host.run(&["pause"]));
        }
        Rest::Stalled => {
            let beyond = ["goal", "0", "0.3", "-1.5", "0", "0", "0", "1", "--keep-going", "--timeout", "20"];
            let stalled = host.run(&beyond);
            assert!(err(&stalled).contains("unreachable"), "{}", err(&stalled));
        }
    }
    let (_directory, bag) = place();
    host.record(&bag);
    crate::record::wait_for(&bag, "/dq_servo/events", 1.0);
    if matches!(rest, Rest::Paused) {
        leave(&host, ["0.1", "0.2", "0.2"]);
        assert_success(&host.run(&["resume"]));
    }
    assert_success(&host.run(&["param", "set", "controller", "diffc"]));
    goal(&host, ["0.1", "0.3", "0.1"]);
    assert_success(&host.run(&["param", "set", "controller", "logc"]));
    goal(&host, ["0.1", "0.3", "0.2"]);
    assert_eq!(host.interrupt("recorder").0, Some(0));
    let servo = replayed(&bag);
    let judged = (servo.different, servo.inputs_missing, servo.not_judged, servo.judged_s.len());
    assert_eq!(judged, (0, 0, 0, 1), "{rest:?} {servo:?}");
    // The goal that was in force at the start of the record continues until the next one.
    let motions = match rest {
        Rest::Settled => 2,
        Rest::Paused => 4,
        Rest::Stalled => 3,
    };
    assert!(servo.motions.len() == motions && servo.commands > 500, "{rest:?} {servo:?}");
}

#[test]
fn a_recording_that_starts_at_a_settled_arm_replays_from_its_start() {
    assert_replays_from_rest(&Rest::Settled);
}

#[test]
fn a_recording_that_starts_at_a_paused_arm_replays_from_its_start() {
    assert_replays_from_rest(&Rest::Paused);
}

#[test]
fn a_recording_that_starts_at_a_stalled_arm_replays_from_its_start() {
    assert_replays_from_rest(&Rest::Stalled);
}

/// Returns the state of the servo, and its goal.
fn state(host: &Host) -> (String, Value) {
    let list: Value = serde_json::from_str(&host.output(&["status", "--json"])).unwrap();
    (list[0]["state"].as_str().unwrap().to_owned(), list[0]["goal"].clone())
}

/// Recorders start, end and are killed. The arm stays at its goal, and the other bags are complete.
#[test]
fn recorders_change_nothing_for_the_arm_and_nothing_for_each_other() {
    let mut host = Host::with_both_nodes();
    let goal = |host: &Host, [x, y, z]: [&str; 3]| {
        assert_success(&host.run(&["goal", x, y, z, "0", "0", "0", "1"]));
    };
    goal(&host, ["-0.125", "0.2", "0.2"]);
    let before = state(&host);
    assert_eq!(before.0, "settled");
    let directory = tempfile::tempdir().unwrap();
    let bag = |name: &str| directory.path().join(name);
    for name in ["ended", "killed", "whole"] {
        host.start(name, &["record", "--out", bag(name).to_str().unwrap()]);
        crate::record::wait_for(&bag(name), "/dq_servo/events", 0.3);
        // Where others use the cores too, joint states may be late for a moment.
        wait_until(|| (state(&host) == before).then_some(()));
    }
    goal(&host, ["0.1", "0.3", "0.1"]);
    host.kill("killed");
    goal(&host, ["0.1", "0.3", "0.2"]);
    assert_eq!(host.interrupt("ended").0, Some(0));
    goal(&host, ["0.1", "0.3", "0.1"]);
    let before = state(&host);
    assert_eq!(host.interrupt("whole").0, Some(0));
    assert_eq!(state(&host), before);
    let said = host.errors("whole");
    assert!(said.contains("/dq_servo can be replayed from 0."), "{said}");
    for (name, motions) in [("killed", 1), ("ended", 2), ("whole", 3)] {
        let servo = replayed(&bag(name));
        assert_eq!(
            (servo.different, servo.inputs_missing, servo.judged_s.len()),
            (0, 0, 1),
            "{name} {servo:?}"
        );
        // The recorder may lack the beginning of the message that was in progress when it joined.
        assert!(servo.not_judged <= 100, "{name} {servo:?}");
        assert!(servo.motions.len() >= motions && servo.commands > 300, "{name} {servo:?}");
    }
}

/// A record may also begin during a motion.
#[test]
fn a_record_that_begins_in_motion_replays_from_there_on() {
    let mut host = Host::with_both_nodes();
    let (_directory, bag) = place();
    let keeps_on = host.run(&[&FAR[..], &["--keep-going", "--timeout", "0.3"]].concat());
    assert_eq!(keeps_on.status.code(), Some(1));
    host.record(&bag);
    crate::record::wait_for(&bag, "/dq_servo/events", 0.0);
    assert_eq!(state(&host).0, "tracking", "the motion goes on as if nobody recorded");
    wait_until(|| (state(&host).0 == "settled").then_some(()));
    assert_success(&host.run(&["goal", "0.1", "0.3", "0.1", "0", "0", "0", "1"]));
    assert_eq!(host.interrupt("recorder").0, Some(0));
    let servo = replayed(&bag);
    let judged = (servo.different, servo.inputs_missing, servo.not_judged, servo.judged_s.len());
    assert_eq!(judged, (0, 0, 0, 1), "{servo:?}");
    let outcomes: Vec<_> = servo.motions.iter().map(|motion| motion.outcome.as_str()).collect();
    assert_eq!(outcomes, ["arrived"; 2]);
}

/// Returns the parameters that are presumed for a bag without parameters.
pub fn built_in() -> ServoParameters {
    Prepared::<ServoParameters>::new(&RosArgs::default()).unwrap().parameters().clone()
}

#[test]
fn the_reported_speed_of_a_robot_is_used_and_replays_bit_for_bit() {
    assert!(recorded_and_replayed(&["speed_scaling"]).2 > 500);
}

#[test]
fn requests_of_another_vendor_take_effect_and_replay_bit_for_bit() {
    // The cases are a stop, a reset of the robot, and a change of the law during a motion. Nothing is sent before the first goal.
    let (_directory, bag, replayed) = recorded_and_replayed(&["services", "switch"]);
    assert!(replayed > 500, "{replayed}");
    let runs = recorded(&bag, "run", &built_in()).unwrap().runs;
    let [run] = runs.as_slice() else { panic!("{} runs", runs.len()) };
    let commands = run.commands[0].velocities.len();
    assert!(run.parameters_known && commands > 500, "{commands}");
}
