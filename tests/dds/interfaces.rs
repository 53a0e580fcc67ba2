//! Tests arms that take positions or trajectories: driven, recorded and replayed.

use crate::described::wait_for_text;
use crate::host::{FAR, FAST, Host, assert_success};
use crate::record::wait_for;
use crate::replay::{assert_replays, built_in, place, recorded_and_replayed};
use dq_runs::{plot, recorded};
use std::fs::File;
use std::path::Path;

/// Runs a motion of an arm with this interface. Returns the number of commands that replay to the bit.
fn there(interface: &str) -> u64 {
    let interface = format!("interface:={interface}");
    let interface = ["--ros-args", "-p", &interface];
    let host = Host::with_nodes(&interface, &interface);
    let (_directory, bag) = place();
    host.output(&[&FAR[..], &["--record", bag.to_str().unwrap()]].concat());
    assert_are_drawn(&bag);
    let (_other_directory, next) = place();
    let goal = ["goal", "0.1", "0.3", "0.1", "0", "0", "0", "1", "--record", next.to_str().unwrap()];
    assert_success(&host.run(&goal));
    assert!(assert_replays(&next) > 100, "begun while the arm was held where it had arrived");
    assert_replays(&bag)
}

/// Checks that commanded positions are drawn over the measured ones, with a small lead.
fn assert_are_drawn(bag: &Path) {
    let runs = recorded(bag, "bag", &built_in()).unwrap().runs;
    let [run] = runs.as_slice() else { panic!("{} runs", runs.len()) };
    // The curve has a gap where the commanded positions begin.
    let positions = &run.commands[0].positions;
    let sent = positions.iter().filter(|(_, sent)| sent.iter().all(|angle| angle.is_finite())).count();
    assert!(sent > 200 && !run.jitter.is_empty());
    let (_, last) = positions.last().unwrap();
    let there = &run.samples.last().unwrap().positions;
    assert!(last.iter().zip(there).all(|(sent, is)| (sent - is).abs() < 0.01), "{last:?} {there:?}");
    let figures = plot(&runs);
    let commands = |name: &str| {
        let figure = figures.iter().find(|figure| figure.name == name).unwrap();
        let series = figure.data["panels"][0]["series"].as_array().unwrap();
        series.iter().filter(|series| series["name"].as_str().unwrap().ends_with(", command")).count()
    };
    assert_eq!((commands("joint_positions"), commands("joint_velocities")), (1, 0));
}

#[test]
fn an_arm_that_takes_positions_arrives_and_its_bag_replays_bit_for_bit() {
    assert!(there("position") > 1000);
}

/// The robot responds after 50 ms, and the law's rate is far beyond the stable one: 140 1/s instead of 31 1/s.
#[test]
fn a_gain_that_the_robots_delay_does_not_allow_is_warned_of_when_the_robot_is_heard() {
    let mut host = Host::new();
    let log = host.file("servo.log", "");
    host.start("plant", &["puma560"]);
    let servo = ["servo", "--ros-args", "-p", "controller:=diffc", "-p", "latency:=0.05"];
    host.start_logging_to("servo", &servo, File::create(&log).unwrap());
    wait_for_text(&log, "the law's rate of 140 1/s is beyond 31 1/s");
    wait_for_text(&log, "a latency of 50.0 ms and a period of 2.0 ms");
}

#[test]
fn an_arm_that_takes_trajectories_arrives_and_its_bag_replays_bit_for_bit() {
    assert!(there("trajectory") > 200);
}

/// Whenever the arm was moved by others, the servo sends nothing until the next goal. The cycles until then have no command.
#[test]
fn positions_that_restart_after_a_silence_replay_bit_for_bit() {
    let position = ["--ros-args", "-p", "interface:=position"];
    let plant = [&position[..], &["-p", "state_rate:=50.0"]].concat();
    let mut host = Host::with_nodes(&plant, &[&position[..], &FAST].concat());
    let (_directory, bag) = place();
    host.record(&bag);
    wait_for(&bag, "/joint_states", 0.0);
    let in_motion = host.run(&[&FAR[..], &["--timeout", "0.3", "--keep-going"]].concat());
    assert!(!in_motion.status.success(), "it has no time to arrive");
    for goal in [&["goal", "-0.1", "0.38", "0.12", "0", "0", "0", "1"], &FAR] {
        assert_success(&host.run(&["reset"]));
        assert_success(&host.run(goal));
    }
    assert_eq!(host.interrupt("recorder").0, Some(0));
    assert!(assert_replays(&bag) > 500);
}

#[test]
fn a_jog_moves_the_arm_while_it_is_sent_and_its_bag_replays_bit_for_bit() {
    assert!(recorded_and_replayed(&["jog"]).2 > 500);
}

#[test]
fn a_robot_with_delays_encoders_and_lag_is_brought_to_its_goal() {
    let robot = [
        "command_latency:=0.01",
        "state_latency:=0.01",
        "velocity_time_constant:=0.02",
        "position_noise:=1e-5",
        "encoder_resolution:=5e-5",
        "state_rate:=125.0",
    ];
    let parameters = robot.iter().flat_map(|value| ["-p", value]);
    let host = Host::with_nodes(&["--ros-args"].into_iter().chain(parameters).collect::<Vec<_>>(), &[]);
    host.output(&FAR);
}
