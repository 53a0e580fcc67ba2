//! Tests the commands for an operator without ROS: goals with their own outcome, stopping, status, and parameters.

use crate::host::{FAR, Host, assert_success, wait_for_line, wait_until};
use dq_bags::Bag;
use dq_runs::replay;
use std::process::Output;

pub fn err(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Returns the servo's status with all figures.
#[track_caller]
pub fn status(host: &Host) -> serde_json::Value {
    let list: serde_json::Value = serde_json::from_str(&host.output(&["status", "--json"])).unwrap();
    list[0].clone()
}

#[test]
fn each_goal_has_its_own_outcome() {
    let host = Host::with_both_nodes();
    let there = host.output(&FAR);
    assert!(there.starts_with("arrived with logc after") && !there.contains("path 0.00"), "{there}");
    // The arm is already at this pose; nevertheless the goal is rejected.
    let rejected = host.run(&[&FAR[..], &["--frame", "nope"]].concat());
    assert_eq!(rejected.status.code(), Some(1), "{}", err(&rejected));
    assert!(err(&rejected).contains("the goal was rejected: frame_id is \"nope\""), "{}", err(&rejected));
    assert!(!err(&rejected).contains("withdrawn"), "the goal in force is another's");
    // The goal is sent again. It has no path, because the arm is there.
    let again = host.output(&FAR);
    assert!(again.contains("after 0.00 s: path 0.0000 m"), "{again}");
    assert_eq!(status(&host)["state"], "settled");
    let beyond = host.run(&["goal", "3", "0", "0", "0", "0", "0", "1"]);
    assert_eq!(beyond.status.code(), Some(1));
    assert!(err(&beyond).contains("m away, and the arm reaches"), "{}", err(&beyond));
}

#[test]
fn a_goal_keeps_the_orientation_or_takes_angles_at_a_servo_of_any_name_and_namespace() {
    let mut host = Host::new();
    host.start("plant", &["puma560", "--ros-args", "-r", "__ns:=/cell"]);
    host.start("servo", &["servo", "--ros-args", "-r", "__ns:=/cell", "-r", "__node:=mover"]);
    let go = |host: &Host, words: &[&str]| {
        let place = ["goal", "-0.125", "0.2", "0.2", "--servo", "/cell/mover"];
        host.output(&[&place[..], words].concat());
        let list: serde_json::Value =
            serde_json::from_str(&host.output(&["status", "/cell/mover", "--json"])).unwrap();
        let goal = list[0]["goal"].as_str().unwrap().to_owned();
        goal.split(' ').map(|number| number.parse::<f64>().unwrap()).collect::<Vec<_>>()
    };
    let angles = go(&host, &["--rpy", "0.1", "0", "0"]);
    let half = 0.05_f64;
    assert!((angles[3] - half.sin()).abs() < 1e-12 && (angles[6] - half.cos()).abs() < 1e-12, "{angles:?}");
    let kept = go(&host, &["--keep-orientation"]);
    // Both signs of a quaternion are the same orientation.
    let product: f64 = angles[3..].iter().zip(&kept[3..]).map(|(a, b)| a * b).sum();
    assert!((1e-16..1e-5).contains(&(1.0 - product.abs())), "the tool's, and not the last goal's: {kept:?}");
    for wrong in [&[][..], &["0", "0", "1"], &["0", "0", "0", "1", "--keep-orientation"]] {
        let refused = host.run(&[&["goal", "0", "0", "0.2"][..], wrong].concat());
        assert_eq!(refused.status.code(), Some(2), "{wrong:?}");
        assert!(err(&refused).contains("the orientation once: QX QY QZ QW, --rpy or --keep-orientation"));
    }
}

#[test]
fn an_interrupted_sender_withdraws_the_goal_or_reports_that_the_motion_continues() {
    let mut host = Host::with_both_nodes();
    let gave_up = host.run(&[&FAR[..], &["--timeout", "0.5"]].concat());
    assert_eq!(gave_up.status.code(), Some(1));
    let message = err(&gave_up);
    assert!(message.contains("not arrived after 0.5 s: tracking, "), "{message}");
    assert!(message.contains("the goal is withdrawn"), "{message}");
    assert!(status(&host).get("goal").is_none());
    let client = host.start("client", &FAR);
    wait_for_line(client, "tracking");
    assert_eq!(host.interrupt("client").0, Some(1));
    assert!(status(&host).get("goal").is_none());
    let kept = host.run(&[&FAR[..], &["--timeout", "0.5", "--keep-going"]].concat());
    assert!(err(&kept).contains("the arm goes on"), "{}", err(&kept));
    assert!(status(&host).get("goal").is_some());
    // Another publisher's goal is not withdrawn.
    let beside = host.run(&["goal", "0", "0", "0.2", "0", "0", "0", "1", "--frame", "nope"]);
    assert_eq!(beside.status.code(), Some(1));
    assert!(status(&host).get("goal").is_some());
}

#[test]
fn there_are_no_figures_before_there_are_joint_states() {
    let host = Host::with_servo();
    let output = host.run(&[&FAR[..], &["--timeout", "1"]].concat());
    assert_eq!(output.status.code(), Some(1));
    assert!(err(&output).contains("waiting_for_state") && !err(&output).contains(" mm"), "{}", err(&output));
    assert!(err(&output).contains("withdrawn"), "an arm that starts later stays");
    assert!(err(&output).contains("is the robot running"), "{}", err(&output));
    let elsewhere =
        host.run(&[&FAR[..], &["--timeout", "1", "--ros-args", "-r", "__ns:=/elsewhere"]].concat());
    assert!(err(&elsewhere).contains("There is /dq_servo: "), "{}", err(&elsewhere));
}

#[test]
fn the_servo_is_stopped_paused_resumed_and_looked_at_without_ros() {
    let host = Host::with_both_nodes();
    host.output(&FAR);
    host.output(&["reset"]);
    assert!(host.output(&["pause"]).starts_with("/dq_servo: decelerating"));
    let paused = host.output(&["status"]);
    assert!(paused.starts_with("/dq_servo: logc, paused") && paused.contains(", goal -0.125"), "{paused}");
    let waits = host.run(&[&FAR[..], &["--timeout", "9"]].concat());
    assert!(
        err(&waits).contains("the servo is paused") && err(&waits).contains("dq_servo resume"),
        "{}",
        err(&waits)
    );
    host.output(&["resume"]);
    host.output(&["stop", "/dq_servo"]);
    assert!(host.output(&["status", "--all"]).contains("no goal"));
    let unknown = [
        (
            vec!["stop", "/other"],
            "no servo called /other within 5 s, but there is /dq_servo (name it, or --all)",
        ),
        (
            vec!["reset", "--ros-args", "-r", "__ns:=/left"],
            "in the namespace /left within 5 s, but there is /puma560",
        ),
        (vec!["reset", "/dq_servo"], "no simulated arm called /dq_servo"),
        (
            vec!["param", "list", "/dq_dual_servo"],
            "is the node running, in this domain? There is /dq_servo, /puma560",
        ),
    ];
    // Each command takes 5 s, so they run at the same time.
    std::thread::scope(|scope| {
        for (arguments, reason) in &unknown {
            let host = &host;
            scope.spawn(move || {
                let output = host.run(arguments);
                assert_eq!(output.status.code(), Some(1), "{arguments:?}");
                assert!(err(&output).contains(reason), "{}", err(&output));
            });
        }
    });
}

#[test]
fn two_arms_take_goals_and_stops_from_the_command_line() {
    let mut host = Host::new();
    host.start_script("launch_scripts/dq_dual_servo.sh", &[]);
    let relative = ["goal", "--dual", "0.1", "-0.4", "-0.5", "0", "0", "0", "1", "--timeout", "30"];
    let arrived = host.output(&relative);
    assert!(arrived.starts_with("arrived with damped_inverse relative_position after"), "{arrived}");
    let joints = host.output(&["goal", "--dual", "--joints", "left/joint2=0.8,right/joint2=0.8"]);
    assert!(joints.starts_with("arrived with joint_line after"), "{joints}");
    let single = host.run(&FAR);
    assert!(err(&single).contains("there is a servo for two arms: --dual"), "{}", err(&single));
    let stopped = host.output(&["stop", "--all"]);
    assert!(stopped.starts_with("/dq_dual_servo: ") && stopped.lines().count() == 1, "{stopped}");
    let mut reset: Vec<_> =
        host.output(&["reset"]).lines().map(|line| line.split(':').next().unwrap().to_owned()).collect();
    reset.sort();
    assert_eq!(reset, ["/left/puma560", "/right/puma560"]);
}

#[test]
fn parameters_are_dumped_and_loaded_and_start_a_node() {
    let mut host = Host::with_both_nodes();
    host.output(&["param", "set", "gains.diffc", "77"]);
    let dump = host.output(&["param", "dump"]);
    let file = host.file("dump.yaml", &dump);
    host.output(&["param", "set", "gains.diffc", "99"]);
    host.output(&["param", "set", "controller", "diffc"]);
    let loaded = host.run(&["param", "load", &file]);
    assert_success(&loaded);
    assert!(err(&loaded).starts_with("2 of "), "{}", err(&loaded));
    assert_eq!(host.output(&["param", "dump"]), dump);
    // Either all parameters of a file are set, or none.
    let bad = host.file("bad.yaml", "dq_servo: {ros__parameters: {controller: diffc, gains: {diffc: -1.0}}}");
    let refused = host.run(&["param", "load", "/dq_servo", &bad]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(err(&refused).contains("gains.diffc"), "{}", err(&refused));
    assert_eq!(host.parameter("controller"), "logc");
    let elsewhere = host.file("elsewhere.yaml", &dump.replace("/dq_servo:", "/left/dq_servo:"));
    let servo =
        host.start("another", &["servo", "--ros-args", "-r", "__ns:=/left", "--params-file", &elsewhere]);
    wait_for_line(servo, "waiting for joint states");
    assert_eq!(host.output(&["param", "get", "/left/dq_servo", "gains.diffc"]), "77.0\n");
    // Parameters for all nodes are ignored if the node does not have them, as at the start of a node.
    let shared = host.file("shared.yaml", "/**: {ros__parameters: {nope: 1, gains: {diffc: 55.0}}}");
    assert!(err(&host.run(&["param", "load", &shared])).contains("no parameter \"nope\": ignored"));
    assert_eq!(host.parameter("gains.diffc"), "55.0");
    let mut stopped: Vec<_> = host.output(&["stop", "--all"]).lines().map(str::to_owned).collect();
    stopped.sort();
    assert!(
        stopped[0].starts_with("/dq_servo: ") && stopped[1].starts_with("/left/dq_servo: "),
        "{stopped:?}"
    );
    let after_a_kill = |host: &mut Host| {
        host.kill("another");
        host.run(&["stop", "/left/dq_servo"])
    };
    let gone = after_a_kill(&mut host);
    assert_eq!(gone.status.code(), Some(1), "{}", err(&gone));
}

#[test]
fn two_nodes_of_one_name_say_so() {
    let mut host = Host::with_servo();
    let second = host.start("second", &["servo"]);
    wait_for_line(second, "2 nodes are called /dq_servo: each needs a name of its own");
    // The first node may answer before the second one is found.
    wait_until(|| {
        let answered = host.run(&["param", "get", "controller"]);
        err(&answered).contains("2 nodes are called /dq_servo").then_some(())
    });
}

#[test]
fn the_joint_at_its_limit_is_named() {
    let mut host = Host::new();
    let file = host.file(
        "limits.yaml",
        "/**: {ros__parameters: {limits: {joint_position_lower: [0.7, -9.0, -9.0, -9.0, -9.0, -9.0]}, progress_timeout: 1.0}}",
    );
    host.start("plant", &["puma560"]);
    host.start_servo("servo", &["--ros-args", "--params-file", &file]);
    let stuck = host.run(&["goal", "0.4", "-0.3", "0.2", "0", "0", "0", "1", "--timeout", "8"]);
    assert_eq!(stuck.status.code(), Some(1));
    assert!(err(&stuck).contains("joint1 is at its position limit"), "{}", err(&stuck));
}

#[test]
fn a_goal_that_stalls_at_a_limit_is_reached_in_another_configuration_where_somebody_asks_for_it() {
    let mut host = Host::new();
    // From theta_initial to theta_desired joint 3 would go from 2.36 to 1.05 rad.
    let file = host.file(
        "limits.yaml",
        "/**: {ros__parameters: {limits: {joint_position_lower: [-9.0, -9.0, 1.6, -9.0, -9.0, -9.0]}, progress_timeout: 1.0}}",
    );
    host.start("plant", &["puma560"]);
    host.start_servo("servo", &["--ros-args", "--params-file", &file]);
    let nothing = host.run(&["reconfigure"]);
    assert_eq!(nothing.status.code(), Some(1));
    assert!(
        err(&nothing).contains("no motion has stalled: no other configuration is needed"),
        "{}",
        err(&nothing)
    );
    let (_directory, bag) = crate::replay::place();
    host.record(&bag);
    crate::record::wait_for(&bag, "/dq_servo/events", 0.0);
    let (place, turn) = (
        ["-0.125", "-0.116868810697", "-0.211871471332"],
        ["-0.790675113362", "0.281211112222", "-0.366481456572", "-0.40180158967"],
    );
    let goal = [&["goal"][..], &place, &turn].concat();
    let client = host.start("client", &goal);
    wait_for_line(
        client,
        "the goal is reachable: `dq_servo reconfigure` or ~/reconfigure takes the arm there",
    );
    let stalled = status(&host);
    assert_eq!(
        (&stalled["state"], &stalled["reconfiguration"]),
        (&"stalled".into(), &"found".into()),
        "{stalled}"
    );
    assert!(
        stalled["reason"].as_str().unwrap().contains("is at its position limit; with joint"),
        "{stalled}"
    );
    let answer = host.output(&["reconfigure"]);
    assert!(answer.starts_with("/dq_servo: going to the other configuration"), "{answer}");
    assert_eq!(host.wait("client"), Some(0));
    assert_eq!(status(&host)["state"], "settled");
    assert_eq!(host.interrupt("recorder").0, Some(0));
    assert!(crate::replay::assert_replays(&bag) > 500);
    let replayed = replay(&mut Bag::open(&bag).unwrap()).unwrap();
    let motions = &replayed[0].motions;
    assert!(motions.len() == 1 && motions[0].outcome == "arrived" && motions[0].reconfigured, "{motions:?}");
    // With `always` the arm continues without a request.
    host.output(&["reset"]);
    host.output(&["param", "set", "reconfigure", "always"]);
    host.output(&["stop"]);
    let arrived = host.output(&goal);
    assert!(arrived.starts_with("arrived with logc in another configuration after"), "{arrived}");
}

/// The texts of 25 hulls of 50 corners do not fit into a reply of a service.
#[test]
fn values_that_are_too_long_for_a_reply_are_listed_dumped_and_loaded() {
    // The corners lie on a ball.
    let corner = |i: usize, j: usize| {
        let (height, turn) = (1.0 - (j as f64 + 0.5) / 25.0, 2.4 * j as f64);
        let radius = (1.0 - height * height).sqrt();
        format!("{:.16} {:.16} {:.16}", 5.0 + i as f64 + radius * turn.cos(), radius * turn.sin(), height)
    };
    let hull = |i: usize| {
        let corners: Vec<_> = (0..50).map(|j| corner(i, j)).collect();
        format!("'crate{i} hull {}'", corners.join(" "))
    };
    let hulls: Vec<_> = (0..25).map(hull).collect();
    let directory = tempfile::tempdir().unwrap();
    let [file, dump] = ["hulls.yaml", "dump.yaml"].map(|name| directory.path().join(name));
    let text = format!("/**:\n  ros__parameters:\n    keep_out: [{}]\n", hulls.join(", "));
    assert!(text.len() > 64_000, "{}", text.len());
    std::fs::write(&file, text).unwrap();
    let host = Host::with_nodes(&[], &["--ros-args", "--params-file", file.to_str().unwrap()]);
    let listed = host.output(&["param", "list"]);
    assert!(
        listed.contains("crate24 hull") && listed.contains("\ncontroller: logc"),
        "{} bytes",
        listed.len()
    );
    assert!(host.parameter("keep_out").contains("crate24 hull"));
    assert_success(&host.run(&["param", "set", "controller", "diffc"]));
    std::fs::write(&dump, host.output(&["param", "dump"])).unwrap();
    assert_success(&host.run(&["param", "set", "controller", "logc"]));
    assert_success(&host.run(&["param", "load", dump.to_str().unwrap()]));
    assert_eq!(host.parameter("controller"), "diffc");
}
