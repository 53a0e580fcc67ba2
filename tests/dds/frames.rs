//! Tests goals in frames of TF from another vendor's nodes, and their replay, which needs no TF.

use crate::commands::{err, status};
use crate::host::{FAR, FAST, Host};
use crate::replay::recorded_and_replayed;
use std::process::Output;
use std::time::Duration;

#[test]
fn goals_in_tf_frames_are_reached_or_rejected_by_name_and_replay_bit_for_bit() {
    assert!(recorded_and_replayed(&["framed_goals"]).2 > 500);
}

#[test]
fn goals_that_wait_for_their_frames_are_rejected_after_a_stop_or_a_jump_and_do_not_end_the_one_in_force() {
    assert!(recorded_and_replayed(&["waiting_goals"]).2 > 500);
}

#[test]
fn a_goal_yields_to_a_sensor_whose_frame_is_in_tf_and_replays_bit_for_bit() {
    assert!(recorded_and_replayed(&["wrench"]).2 > 500);
}

#[test]
fn a_goal_follows_its_frame_holds_when_the_frame_is_lost_and_replays_bit_for_bit() {
    assert!(recorded_and_replayed(&["followed_goal"]).2 > 500);
}

#[test]
fn shapes_on_keep_out_are_avoided_with_any_parameters() {
    let (mut host, file) = (Host::new(), tempfile::NamedTempFile::new().unwrap());
    host.start("plant", &["puma560"]);
    let servo = [&["servo"], &FAST[..], &["-p", "constraints:=true"]].concat();
    host.start_logging_to("servo", &servo, file.reopen().unwrap());
    host.peer(&["keep_out"]);
    host.interrupt("servo");
    let log = std::fs::read_to_string(file.path()).unwrap();
    for why in [
        "\"bad\" 1 of ~/keep_out is not obeyed: ",
        "(and 4 more)",
        "TF has no frame \"nowhere\"",
        "(and 4936 more)",
        "does not move: TF no longer updates its frame \"hand\"",
        "constraints is false: the arm ignores the 1 of",
    ] {
        assert!(log.contains(why), "{why}: {log}");
    }
    assert!(!log.contains("there are 0"), "{log}");
}

/// Starts an arm whose servo lets a goal wait up to 1.5 s for its frame, and a peer that publishes the frame `milliseconds` after a
/// goal.
fn with_a_table_after(milliseconds: &str) -> Host {
    let mut host = Host::with_nodes(&[], &["--ros-args", "-p", "tf_timeout:=1.5"]);
    host.start_peer(&["late_table", milliseconds]);
    std::thread::sleep(Duration::from_secs(2));
    host
}

fn go_by_the_table(host: &Host, timeout: &str) -> Output {
    host.run(&["goal", "0.3", "0.2", "0.2", "0", "0", "0", "1", "--frame", "table", "--timeout", timeout])
}

/// Waits longer than any goal waits for its frame.
fn wait_for_what_may_come() {
    std::thread::sleep(Duration::from_secs(4));
}

#[test]
fn a_goal_that_waits_for_its_frame_is_withdrawn_when_its_sender_gives_up() {
    let host = with_a_table_after("1200");
    let gave_up = go_by_the_table(&host, "0.2");
    assert_eq!(gave_up.status.code(), Some(1));
    assert!(err(&gave_up).contains("the goal is withdrawn"), "{}", err(&gave_up));
    wait_for_what_may_come();
    assert_eq!(status(&host)["goal_count"], 0, "nothing has moved");
    // The goal of another publisher stays in force until the frame of this one is found.
    host.run(&[&FAR[..], &["--timeout", "0.5", "--keep-going"]].concat());
    let gave_up = go_by_the_table(&host, "0.2");
    assert!(err(&gave_up).contains("the goal is withdrawn"), "{}", err(&gave_up));
    wait_for_what_may_come();
    let now = status(&host);
    assert!(now["goal_count"] == 2 && now.get("goal").is_none(), "{now}");
}

#[test]
fn a_goal_rejected_for_an_unknown_frame_is_not_followed_later() {
    let host = with_a_table_after("2200");
    let rejected = go_by_the_table(&host, "10");
    assert_eq!(rejected.status.code(), Some(1));
    assert!(err(&rejected).contains("the goal was rejected: frame_id is \"table\""), "{}", err(&rejected));
    wait_for_what_may_come();
    assert_eq!(status(&host)["goal_count"], 0);
}
