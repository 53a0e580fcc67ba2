//! What was recorded over DDS, replayed without it: the same commands to the last bit. And the plots of it.

use crate::host::{Host, assert_success, wait_for_line};
use dq_servo::config::ServoParameters;
use dq_servo::nodes::Prepared;
use dq_servo::record::Bag;
use dq_servo::ros::RosArgs;
use dq_servo::runs::{Timeline, recorded, replay};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// A place for a bag, gone with the test.
pub fn place() -> (tempfile::TempDir, PathBuf) {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("run");
    (directory, path)
}

/// Replays a bag: how many commands were the same, of the only servo in it.
#[track_caller]
pub fn assert_replays(bag: &Path) -> u64 {
    let replayed = replay(&Timeline::read(Bag::open(bag).unwrap())).unwrap();
    let [servo] = replayed.as_slice() else { panic!("{replayed:?}") };
    assert_eq!((servo.different, servo.inputs_missing), (0, 0), "{servo:?}");
    servo.commands
}

/// Records both nodes while another vendor's peer plays these cases: the bag, and how many of its commands are replayed to the bit.
#[track_caller]
pub fn recorded_and_replayed(cases: &[&str]) -> (tempfile::TempDir, PathBuf, u64) {
    let mut host = Host::with_both_nodes();
    let (directory, bag) = place();
    host.start("recorder", &["record", "-o", bag.to_str().unwrap()]);
    crate::record::wait_for(&bag, "/joint_states", 0.0);
    cases.iter().for_each(|case| host.peer_with(&[("READERS", "2")], &[case]));
    assert_eq!(host.interrupt("recorder").0, Some(0));
    let commands = assert_replays(&bag);
    (directory, bag, commands)
}

/// Records the demo; what it printed, and what `plot` prints of its bag.
fn demo_and_plot(arguments: &[&str], bag: &Path, figures: usize) -> (Vec<Value>, Vec<Value>) {
    let host = Host::new();
    let text = bag.to_str().unwrap();
    let demo = host.run(&[&["demo", "--json", "--record", text], arguments].concat());
    assert_success(&demo);
    let plots = bag.with_extension("plots");
    let plot = host.run(&["plot", text, "--json", "--out", plots.to_str().unwrap()]);
    assert_success(&plot);
    assert_eq!(plots.read_dir().unwrap().count(), 2 * figures, "SVG and PNG");
    (serde_json::from_slice(&demo.stdout).unwrap(), serde_json::from_slice(&plot.stdout).unwrap())
}

/// Both repeat what the servo said.
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
fn the_demo_s_bag_replays_to_the_bit_and_its_plot_tells_the_same() {
    let (_directory, bag) = place();
    let (told, plotted) = demo_and_plot(&[], &bag, 6);
    assert!(assert_replays(&bag) > 1000);
    assert_eq!((told.len(), plotted.len()), (2, 2));
    for (told, plotted) in told.iter().zip(&plotted) {
        assert_eq!(told["law"], plotted["law"]);
        assert_alike(told, plotted);
    }
}

/// What an arm is commanded that takes positions is how fast they go on, not what the arm made of them: more slowly where cycles were
/// missed.
#[test]
fn the_demo_of_an_arm_that_takes_positions_too() {
    let (_directory, bag) = place();
    let position = ["--ros-args", "-p", "command_interface:=position"];
    let (told, plotted) = demo_and_plot(&position, &bag, 6);
    assert!(assert_replays(&bag) > 1000);
    for (told, plotted) in told.iter().zip(&plotted) {
        assert_alike(told, plotted);
    }
}

/// Without a clock all that it stamps has the same stamp.
#[test]
fn a_bag_in_simulated_time_replays_to_the_bit() {
    let host = Host::new();
    let (_directory, bag) = place();
    let demo = ["demo", "--record", bag.to_str().unwrap(), "--ros-args", "-p", "use_sim_time:=true"];
    assert_success(&host.run(&demo));
    assert!(assert_replays(&bag) > 1000);
}

#[test]
fn the_demo_of_two_arms_too() {
    let (_directory, bag) = place();
    let (told, plotted) = demo_and_plot(&["--dual"], &bag, 6);
    assert!(assert_replays(&bag) > 1000);
    assert_alike(&told[0], &plotted[0]);
    assert_alike(&told[1], plotted.last().unwrap());
}

#[test]
fn a_goal_is_recorded_from_the_start() {
    let host = Host::with_both_nodes();
    assert_success(&host.run(&["param", "set", "controller", "diffc"]));
    let (directory, bag) = place();
    let goal = ["goal", "-0.125", "0.2", "0.2", "0", "0", "0", "1", "--record"];
    assert_success(&host.run(&[goal.as_slice(), &[bag.to_str().unwrap()]].concat()));
    assert!(assert_replays(&bag) > 100);
    // The next one is recorded while the arm is held where it has arrived.
    let bag = directory.path().join("next");
    let goal = ["goal", "0.1", "0.3", "0.1", "0", "0", "0", "1", "--record"];
    assert_success(&host.run(&[goal.as_slice(), &[bag.to_str().unwrap()]].concat()));
    assert!(assert_replays(&bag) > 100);
    let plots = directory.path().join("plots");
    let plot = host.run(&["plot", bag.to_str().unwrap(), "--json", "--out", plots.to_str().unwrap()]);
    assert_success(&plot);
    let motions: Vec<Value> = serde_json::from_slice(&plot.stdout).unwrap();
    assert!(motions.len() == 1 && motions[0]["path_length_m"].as_f64().unwrap() > 0.1, "{motions:?}");
    assert!(
        motions[0]["arrival_time_s"].as_f64().unwrap() > 1.0 && motions[0]["law"] == "diffc",
        "{motions:?}"
    );
}

/// As people record: the arm is up and holds a goal that it reached before, or is paused on its way; then goals come while all is recorded.
#[test]
fn what_is_recorded_while_the_arm_stands_replays_from_the_next_goal_on() {
    for interface in ["velocity", "position"] {
        let mut host = Host::new();
        let parameter = format!("command_interface:={interface}");
        host.start("plant", &["puma560", "--ros-args", "-p", &parameter]);
        let servo = host.start("servo", &["servo", "--ros-args", "-p", &parameter]);
        wait_for_line(servo, "waiting_for_state -> holding");
        let goal = |host: &Host, [x, y, z]: [&str; 3]| {
            assert_success(&host.run(&["goal", x, y, z, "0", "0", "0", "1"]));
        };
        goal(&host, ["-0.125", "0.2", "0.2"]);
        let is_paused = interface == "velocity";
        if is_paused {
            let gives_up =
                ["goal", "0.1", "0.3", "0.3", "0", "0", "0", "1", "--keep-going", "--timeout", "0.6"];
            assert_eq!(host.run(&gives_up).status.code(), Some(1));
            assert_success(&host.run(&["pause"]));
        }
        let (_directory, bag) = place();
        host.start("recorder", &["record", "-o", bag.to_str().unwrap()]);
        // The replay warms up over what was commanded before the goal.
        crate::record::wait_for(&bag, &format!("/forward_{interface}_controller/commands"), 1.0);
        if is_paused {
            let waits = ["goal", "0.1", "0.2", "0.2", "0", "0", "0", "1", "--keep-going", "--timeout", "0.5"];
            assert_eq!(host.run(&waits).status.code(), Some(1));
            assert_success(&host.run(&["resume"]));
        }
        goal(&host, ["0.1", "0.3", "0.1"]);
        goal(&host, ["0.1", "0.3", "0.2"]);
        assert_eq!(host.interrupt("recorder").0, Some(0));
        assert!(assert_replays(&bag) > 1000, "{interface}");
    }
}

/// The arms that are presumed where a bag does not say.
pub fn built_in() -> ServoParameters {
    Prepared::<ServoParameters>::new(&RosArgs::default()).unwrap().parameters().clone()
}

#[test]
fn a_bag_begun_after_changes_of_parameters_replays_to_the_bit() {
    let host = Host::with_both_nodes();
    for (name, value) in
        [("controller", "diffc"), ("limits.linear_speed", "0.4"), ("controller", "double_geodesic")]
    {
        assert_success(&host.run(&["param", "set", name, value]));
    }
    let (_directory, bag) = place();
    let goal = ["goal", "-0.125", "0.2", "0.2", "0", "0", "0", "1", "--record", bag.to_str().unwrap()];
    assert_success(&host.run(&goal));
    assert!(assert_replays(&bag) > 100);
    let runs = recorded(&bag, "run", &built_in()).unwrap().runs;
    let [run] = runs.as_slice() else { panic!("{} runs", runs.len()) };
    // RustDDS keeps more of a latched topic than its depth says, so that laws from before the bag may be in it too.
    let law = run.laws.last().map(|(_, law)| law.as_str());
    assert_eq!((run.parameters_known, law), (true, Some("double_geodesic")));
}

#[test]
fn what_another_vendor_asks_for_replays_to_the_bit() {
    // A pause, a stop, the robot back at its start, and a law switched in motion; nothing is sent before the first goal.
    let (_directory, bag, replayed) = recorded_and_replayed(&["services", "switch"]);
    assert!(replayed > 500, "{replayed}");
    let runs = recorded(&bag, "run", &built_in()).unwrap().runs;
    let [run] = runs.as_slice() else { panic!("{} runs", runs.len()) };
    let commands = run.commands[0].velocities.len();
    assert!(run.parameters_known && commands > 500, "{commands}");
}
