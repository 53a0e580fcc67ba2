//! Tests with real processes over real DDS, each in its own network namespace with loopback only.

mod commands;
mod described;
mod examples;
mod frames;
mod graph;
mod host;
mod interfaces;
mod joint_goals;
mod memory;
mod networks;
mod own_law;
mod readme;
mod record;
mod replay;
mod routed;
mod simulated_time;
mod terminal;
mod two_arms;

use host::{FAR, FAST, Host, assert_success, wait_for_line};
use serde_json::Value;

/// The path of the peer program, which uses another vendor's DDS.
const PEER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/dds/peer.py");

#[test]
fn the_demo_of_an_arm_in_the_box_moves_it_there_and_back() {
    let host = Host::new();
    let motions: Vec<Value> =
        serde_json::from_str(&host.output(&["demo", "--arm", "panda", "--json"])).unwrap();
    assert_eq!(motions.iter().map(|motion| &motion["law"]).collect::<Vec<_>>(), ["logc", "diffc"]);
    for motion in &motions {
        assert!(motion["position_error_m"].as_f64().unwrap() <= 1e-3, "{motion}");
        assert!(motion["straight_line_m"].as_f64().unwrap() > 0.05, "{motion}");
    }
    let refused = host.run(&["demo", "--arm", "panda", "--dual"]);
    assert_eq!(refused.status.code(), Some(2));
}

#[test]
fn a_first_motion_of_a_ur5e_is_slow() {
    let mut host = Host::new();
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/msg_config/first_motion.yaml");
    host.start("plant", &["arm", "--arm", "ur5e"]);
    host.start_servo("servo", &["--arm", "ur5e", "--ros-args", "--params-file", file]);
    let pose = host.output(&["pose", "--arm", "ur5e", "0.1", "-1.5", "1.5", "-1.57", "-1.57", "0.1"]);
    let goal = pose.lines().find_map(|line| line.strip_prefix("dq_servo ")).unwrap();
    let arrived = host.output(&goal.split_whitespace().collect::<Vec<_>>());
    let numbers =
        arrived.split_whitespace().filter_map(|word| word.trim_end_matches(':').parse::<f64>().ok());
    let [seconds, path, ..] = numbers.collect::<Vec<_>>()[..] else { panic!("{arrived}") };
    assert!(path > 0.05 && path <= 0.05 * seconds, "{arrived}");
    assert_eq!(host.parameter("constraints"), "true");
}

#[test]
fn two_arms_take_a_goal_parameters_and_services_from_another_vendor() {
    let mut host = Host::new();
    host.start_script("launch_scripts/dq_dual_servo.sh", &["--ros-args", "--log-level", "info"]);
    host.peer(&["dual"]);
    host.signal("script", "TERM");
    assert_eq!(host.wait("script"), Some(143));
}

#[test]
fn a_goal_from_another_vendor_moves_the_arm() {
    let host = Host::with_both_nodes();
    host.peer(&["arrive"]);
}

#[test]
fn parameters_answer_both_vendors_mappings() {
    let host = Host::with_both_nodes();
    host.peer(&["parameters"]);
}

#[test]
fn markers_and_a_goal_to_drag_are_as_rviz_takes_them() {
    let host = Host::with_both_nodes();
    host.peer(&["pictures"]);
}

#[test]
fn a_servo_that_gets_a_signal_brings_the_arm_to_rest() {
    const HANGUP_INTERRUPT_QUIT_TERMINATE: [&str; 4] = ["1", "2", "3", "15"];
    for signal in HANGUP_INTERRUPT_QUIT_TERMINATE {
        let mut host = Host::with_both_nodes();
        let servo = host.pid("servo");
        host.peer(&["interrupt", &servo.to_string(), signal]);
        assert_eq!(host.wait("servo"), Some(0), "signal {signal}");
    }
}

#[test]
fn a_second_signal_ends_a_servo_at_once_with_zeros() {
    let mut host = Host::new();
    host.start("plant", &["puma560"]);
    let slow = ["limits.joint_velocity", "limits.joint_acceleration"]
        .map(|limit| format!("{limit}:=[1.0, 1.0, 1.0, 1.0, 1.0, 1.0]"));
    host.start("servo", &["servo", "--ros-args", "-p", &slow[0], "-p", &slow[1]]);
    let servo = host.pid("servo");
    host.peer(&["interrupt_twice", &servo.to_string()]);
    assert_eq!(host.wait("servo"), Some(1));
    assert!(host.errors("servo").contains("error: a second signal"));
}

#[test]
fn a_servo_started_by_nohup_stays_when_the_terminal_goes() {
    let mut host = Host::new();
    let ignoring = format!("trap '' HUP; exec {} servo", env!("CARGO_BIN_EXE_dq_servo"));
    wait_for_line(host.start_program("servo", "sh", &["-c", &ignoring]), "waiting for joint states");
    host.signal("servo", "HUP");
    host.shell("sleep 0.3");
    host.signal("servo", "TERM");
    assert_eq!(host.wait("servo"), Some(0));
}

/// Two demos at the same time, in the domain of a running robot and its servo.
#[test]
fn a_demo_meets_neither_a_robot_that_is_up_nor_another_demo() {
    let mut host = Host::new();
    host.start("plant", &["puma560"]);
    host.start("servo", &["servo", "--ros-args", "--log-level", "debug"]);
    let domains = std::thread::scope(|scope| {
        let demo = || {
            let output = host.run(&["demo"]);
            assert_success(&output);
            let table = String::from_utf8_lossy(&output.stdout).into_owned();
            assert!(table.contains("logc"), "{table}");
            let log = String::from_utf8_lossy(&output.stderr).into_owned();
            let (_, rest) = log.split_once("ROS_DOMAIN_ID=").unwrap();
            rest.split(' ').next().unwrap().to_owned()
        };
        let demos = [scope.spawn(demo), scope.spawn(demo)];
        demos.map(|demo| demo.join().unwrap())
    });
    assert_ne!(domains[0], domains[1]);
    assert!(!domains.contains(&"77".to_owned()));
    host.signal("servo", "TERM");
    assert_eq!(host.wait("servo"), Some(0));
    let log = host.errors("servo");
    assert!(log.contains("waiting_for_state -> holding"), "{log}");
    for meddling in ["goal", "tracking", "controller", "publishers"] {
        assert!(!log.contains(meddling), "{log}");
    }
}

#[test]
fn a_goal_without_a_servo_or_without_a_robot_says_what_is_missing() {
    let mut host = Host::new();
    let goal = |host: &Host| {
        let output = host.run(&[&FAR[..], &["--timeout", "4"]].concat());
        assert_eq!(output.status.code(), Some(1));
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    let errors = goal(&host);
    assert!(errors.starts_with("no servo found so far") && errors.contains("error: no status"), "{errors}");
    host.start("servo", &["servo"]);
    let errors = goal(&host);
    assert!(errors.contains("no joint states"), "{errors}");
}

#[test]
fn parameters_are_reached_from_the_command_line() {
    let host = Host::with_both_nodes();
    let text = |arguments: &[&str]| host.output(arguments);
    assert!(text(&["param", "list"]).lines().any(|line| line == "gains.diffc: 185.0"));
    assert!(text(&["param", "list", "puma560"]).lines().any(|line| line == "command_timeout: 0.1"));
    text(&["param", "set", "controller", "diffc"]);
    assert_eq!(text(&["param", "get", "/dq_servo", "controller"]), "diffc\n");
    assert!(text(&["param", "describe", "update_rate"]).contains("integer (read-only)"));
    let joints = "joints: string array (read-only)\n  joint names, base first\n";
    assert_eq!(text(&["param", "describe", "joints"]), joints);
    text(&["param", "set", "gains.diffc", "20"]);
    assert_eq!(text(&["param", "get", "gains.diffc"]), "20.0\n", "an integer is taken for a double");
    for (arguments, reason) in [
        (["param", "set", "gains.diffc", "-3"], "cannot be -3.0"),
        (["param", "set", "update_rate", "100"], "read-only"),
        (["param", "set", "gains.difc", "3"], "did you mean \"gains.diffc\"?"),
        (["param", "get", "/dq_servo", "gains.difc"], "did you mean \"gains.diffc\"?"),
    ] {
        let output = host.run(&arguments);
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2));
        assert!(message.contains(reason) && message.lines().count() == 1, "{message}");
    }
}

#[test]
fn parameters_of_another_vendor_s_node_are_reached() {
    let mut host = Host::new();
    host.start_peer(&["serve"]);
    assert_eq!(host.output(&["param", "get", "/other", "speed"]), "1.5\n");
}

#[test]
fn ros_arguments_name_the_nodes_and_set_their_parameters() {
    let mut host = Host::new();
    let file = host.file("params.yaml", "/**/renamed:\n  ros__parameters:\n    gains: {logc: [1.0, 2.5]}\n");
    let names = ["--ros-args", "-r", "__ns:=/left", "-r", "__node:=renamed"];
    let more = ["--params-file", file.as_str(), "-p", "gains.diffc:=100"];
    host.start("servo", &[&["servo"], &names[..], &more[..]].concat());
    let get = |name: &str| host.output(&["param", "get", "/left/renamed", name]);
    assert_eq!(get("gains.logc"), "[1.0, 2.5]\n");
    assert_eq!(get("gains.diffc"), "100.0\n");
}

#[test]
fn the_launch_script_starts_both_nodes_and_ends_them() {
    let mut host = Host::new();
    host.start_script("launch_scripts/dq_servo.sh", &["--ros-args", "-r", "__ns:=/left"]);
    host.output(&[&FAR[..], &["--ros-args", "-r", "__ns:=/left"]].concat());
    host.signal("script", "TERM");
    assert_eq!(host.wait("script"), Some(143));
}

#[test]
fn without_a_network_the_error_says_so() {
    let host = Host::without_network();
    for command in ["demo", "servo"] {
        let output = host.run(&[command]);
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(1), "{message}");
        assert!(message.contains("no usable network interface"), "{message}");
    }
}

#[test]
fn a_known_peer_that_returns_after_its_lease_ends_only_the_servo_that_heard_it() {
    const LEASE: &str =
        "<CycloneDDS><Domain><Discovery><LeaseDuration>2s</LeaseDuration></Discovery></Domain></CycloneDDS>";
    let mut host = Host::new();
    host.start("plant", &["puma560"]);
    host.start("servo", &["servo"]);
    host.peer_with(&[("CYCLONEDDS_URI", LEASE)], &["unheard"]);
    assert_eq!(host.wait("servo"), Some(4));
    let errors = host.errors("servo");
    let error = errors.lines().find(|line| line.contains("and is back")).expect(&errors);
    assert!(error.starts_with("error: ") && error.contains("/goal_pose"), "{error}");
    // The plant received nothing from the other domain.
    assert_eq!(host.child("plant").try_wait().unwrap(), None, "the plant has ended");
    // A servo that a supervisor restarts ignores earlier goals, and obeys new ones.
    host.start_servo("servo", &FAST);
    host.output(&FAR);
}

/// `ros2 launch` ends all nodes at once. The servo of an arm that has settled still commands small speeds.
#[test]
fn a_guard_that_ends_with_its_servo_does_not_report_an_arm_that_has_settled() {
    let mut host = Host::new();
    host.start("plant", &["puma560"]);
    host.start("guard", &["guard"]);
    host.start_servo("servo", &FAST);
    host.output(&FAR);
    host.signal("guard", "INT");
    host.shell("sleep 0.1");
    host.signal("servo", "INT");
    assert_eq!((host.wait("servo"), host.wait("guard")), (Some(0), Some(0)));
    let log = host.errors("guard");
    assert!(log.contains("watching") && !log.contains("commanded to move"), "{log}");
}

#[test]
fn the_launch_script_starts_the_guard_and_no_arm_where_it_is_asked_to() {
    let mut host = Host::new();
    host.start("plant", &["puma560"]);
    host.start_script("launch_scripts/dq_servo.sh", &["sim:=false", "guard:=true"]);
    host.peer(&["guarded"]);
    host.output(&FAR);
    host.signal("script", "TERM");
    assert_eq!(host.wait("script"), Some(143));
}
