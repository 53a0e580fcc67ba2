//! Tests servo and plant that are killed, frozen, restarted or stopped.

use crate::host::{FAST, Host, wait_for_line};
use crate::outcome::{run, run_with_both_nodes};
use std::io::{PipeWriter, Write};

#[test]
fn a_servo_killed_in_motion_leaves_a_plant_that_stops_by_its_own_timeout() {
    let host = Host::with_both_nodes();
    run(&host, "kill", &[&host.pid("servo").to_string()]);
}

#[test]
fn a_plant_killed_in_motion_and_started_again_needs_the_goal_again() {
    let mut host = Host::with_both_nodes();
    run(&host, "plant_gone", &[&host.pid("plant").to_string()]);
    host.start("plant again", &["puma560"]);
    run(&host, "plant_back", &[]);
}

#[test]
fn an_earlier_goal_does_not_move_the_arm_of_a_restarted_servo() {
    let mut host = Host::with_both_nodes();
    let bag = tempfile::tempdir().unwrap();
    let folder = bag.path().join("bag");
    host.start("recorder", &["record", "--out", folder.to_str().unwrap()]);
    let commands = tempfile::NamedTempFile::new().unwrap();
    let [servo, recorder] = ["servo", "recorder"].map(|name| host.pid(name).to_string());
    host.start_peer(&["left_over", commands.path().to_str().unwrap(), &servo, &recorder]);
    assert_eq!(host.wait("servo"), Some(0));
    host.start("servo again", &[&["servo"], &FAST[..]].concat());
    assert_eq!(host.wait("peer"), Some(0));
}

/// RustDDS does not survive a stop of its process (see dds/ended_threads.rs).
const ENDED: &str = "DDS has ended in this process";

#[test]
fn a_servo_frozen_in_motion_lets_the_plant_stop_and_thawed_ends_with_the_reason() {
    let mut host = Host::new();
    host.start("plant", &["puma560"]);
    host.start("servo", &[&["servo"], &FAST[..]].concat());
    run(&host, "frozen_servo", &[&host.pid("servo").to_string()]);
    assert_eq!(host.wait("servo"), Some(4));
    assert!(host.errors("servo").contains(ENDED));
    host.start_servo("servo again", &FAST);
    run(&host, "arrive", &[]);
}

#[test]
fn a_servo_that_loses_its_core_for_half_a_second_begins_again_at_the_speed_of_the_robot() {
    // Users other than root may take no core from others, and one core has no other for the plant.
    let cores = std::thread::available_parallelism().unwrap().get();
    let Some(mut host) = Host::of_root().filter(|_| cores > 1) else { return };
    host.start("plant", &["puma560"]);
    host.start("servo", &[&["servo"], &FAST[..]].concat());
    run(&host, "starved", &[&host.pid("servo").to_string()]);
}

#[test]
fn a_plant_frozen_in_motion_stops_the_servo_which_follows_the_next_plant() {
    let mut host = Host::with_both_nodes();
    run(&host, "frozen_plant", &[&host.pid("plant").to_string()]);
    assert_eq!(host.wait("plant"), Some(4));
    assert!(host.errors("plant").contains(ENDED));
    host.start("plant again", &["puma560"]);
    run(&host, "plant_back", &[]);
}

#[test]
fn a_plant_reset_in_motion_is_followed_from_its_start() {
    run_with_both_nodes("reset_in_motion", &[]);
}

/// The capacity of a pipe (pipe(7)) \[bytes\].
const PIPE: usize = 65_536;

/// Runs a servo whose log goes into this pipe. The servo must work nevertheless, and end on request.
fn with_log(log: PipeWriter) {
    let mut host = Host::new();
    host.start("plant", &["puma560"]);
    host.start_logging_to("servo", &["servo", "--ros-args", "--log-level", "debug"], log);
    run(&host, "stop_and_end", &[&host.pid("servo").to_string()]);
    assert_eq!(host.wait("servo"), Some(0));
}

#[test]
fn a_servo_whose_log_is_blocked_moves_stops_and_ends() {
    let (_reader, mut writer) = std::io::pipe().unwrap();
    writer.write_all(&[b'\n'; PIPE]).unwrap();
    with_log(writer);
}

#[test]
fn a_servo_whose_log_is_not_read_any_more_moves_stops_and_ends() {
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    with_log(writer);
}

/// Starts a plant that continues at its last velocity for 10 s, as real controllers do forever. Also starts a servo and these
/// guards.
fn guarded(guards: &[&str], interface: &str) -> Host {
    let mut host = Host::new();
    let interface = format!("interface:={interface}");
    host.start("plant", &["puma560", "--ros-args", "-p", "command_timeout:=10.0", "-p", &interface]);
    for name in guards {
        let node = format!("__node:={name}");
        let guard = host.start(name, &["guard", "--ros-args", "-r", &node, "-p", &interface]);
        wait_for_line(guard, "watching /");
    }
    host.start_servo("servo", &["--ros-args", "-p", &interface]);
    host
}

#[test]
fn a_servo_that_takes_positions_killed_in_motion_is_held_by_its_guard_where_the_arm_is() {
    let host = guarded(&["guard"], "position");
    run(&host, "guarded_positions", &[&host.pid("servo").to_string()]);
}

#[test]
fn an_arm_that_takes_positions_and_jumps_is_not_called_back_by_its_guard() {
    run(&guarded(&["guard"], "position"), "guarded_reset", &[]);
}

/// A process that keeps the first core busy.
struct Busy(std::process::Child);

impl Busy {
    fn new() -> Self {
        let mut busy = std::process::Command::new("taskset");
        Self(busy.args(["--cpu-list", "0", "sh", "-c", "while :; do :; done"]).spawn().unwrap())
    }
}

impl Drop for Busy {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[test]
fn a_guard_that_gets_no_time_sends_nothing_while_the_servo_lives() {
    let host = guarded(&["guard"], "velocity");
    // The guard gets only the time that nobody else needs on the first core.
    let guard = host.pid("guard");
    host.shell(&format!("taskset --all-tasks --cpu-list --pid 0 {guard}"));
    host.shell(&format!("chrt --all-tasks --idle --pid 0 {guard}"));
    let _busy = Busy::new();
    run(&host, "guard_without_time", &[]);
}

#[test]
fn two_guards_are_harmless_and_silent_where_the_servo_ends_in_order() {
    let host = guarded(&["guard", "other"], "velocity");
    run(&host, "guarded_end", &[&host.pid("servo").to_string()]);
}

#[test]
fn two_guards_stop_the_arm_of_a_killed_servo_together_and_leave_the_next_one_alone() {
    let mut host = guarded(&["guard", "other"], "velocity");
    run(&host, "guarded_kill", &[&host.pid("servo").to_string()]);
    host.start_servo("servo again", &FAST);
    run(&host, "arrive", &[]);
}

/// The script ends the guard as soon as the servo is gone, and returns the guard's code.
#[test]
fn a_servo_of_the_launch_script_killed_in_motion_is_stopped_by_its_guard() {
    let mut host = Host::new();
    host.start("plant", &["puma560", "--ros-args", "-p", "command_timeout:=10.0"]);
    host.start_script("launch_scripts/dq_servo.sh", &["sim:=false", "guard:=true"]);
    run(&host, "guarded_kill", &[&host.child_of("script", "servo").to_string()]);
    assert_eq!(host.wait("script"), Some(128 + 9));
}

#[test]
fn a_guard_that_is_killed_is_missed_by_the_servo() {
    let host = guarded(&["guard"], "velocity");
    run(&host, "guard_killed", &[&host.pid("guard").to_string()]);
}
