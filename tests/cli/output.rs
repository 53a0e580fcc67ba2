//! Tests the output of poses, and the help.

use crate::dq_servo;
use serde_json::Value;

const THETA_INITIAL: &str = "0.7853981633974483 1.0471975511965976 2.356194490192345 0.5235987755982988 \
                             -0.7853981633974483 2.0943951023931953";

#[test]
fn pose_prints_the_paper_s_dual_quaternion() {
    let output =
        dq_servo(&format!("pose --json {THETA_INITIAL}")).assert().success().get_output().stdout.clone();
    let pose: Value = serde_json::from_slice(&output).unwrap();
    let reference: Value = serde_json::from_str(include_str!("../data/reference.json")).unwrap();
    let numbers =
        |value: &Value| value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect::<Vec<_>>();
    let (ours, printed) = (numbers(&pose["dual_quaternion"]), numbers(&reference["printed"]["q_initial"]));
    assert!(ours.iter().zip(&printed).all(|(a, b)| (a - b).abs() < 1e-12), "{ours:?}");
    let xyzw = numbers(&pose["orientation_xyzw"]);
    assert_eq!(xyzw, [ours[1], ours[2], ours[3], ours[0]]);
    assert_eq!(numbers(&pose["position"]).len(), 3);
}

#[test]
fn pose_prints_lines_for_goal_and_for_ros2_topic_pub() {
    let output = dq_servo(&format!("pose {THETA_INITIAL}")).assert().success().get_output().stdout.clone();
    let text = String::from_utf8(output).unwrap();
    let (before, message) = text.split_once("  \"").unwrap();
    let goal = before.lines().find_map(|line| line.strip_prefix("dq_servo goal ")).unwrap();
    let numbers: Vec<f64> = goal.split(' ').map(|number| number.parse().unwrap()).collect();
    assert!(numbers.len() == 7 && (numbers[0] - 0.1303602522913436).abs() < 1e-12, "{goal}");
    let yaml: Value = serde_saphyr::from_str(message.trim_end().trim_end_matches('"')).unwrap();
    assert_eq!(yaml["header"]["frame_id"], "base_link");
    assert!((yaml["pose"]["position"]["x"].as_f64().unwrap() - 0.1303602522913436).abs() < 1e-12);
}

/// An arm's joints are often known in degrees.
#[test]
fn pose_warns_of_angles_beyond_a_full_turn() {
    for (joints, warning) in [
        ("90 0 0 0 0 0", "joint1 at 90 rad is more than a full turn"),
        ("0 0 0 0 0 -6.3", "joint6 at -6.3 rad is more than a full turn"),
        ("6.28 0 0 0 0 -6.28", ""),
    ] {
        let output = dq_servo(&format!("pose {joints}")).assert().success().get_output().clone();
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(said.contains(warning) && said.is_empty() == warning.is_empty(), "{joints}: {said}");
    }
}

#[test]
fn help_and_version_are_not_errors() {
    dq_servo("--version").assert().success();
    for (arguments, said) in [
        // There is no user at a terminal, but a script that lacks the subcommand.
        ("", "Run the servo node"),
        ("--help", "-r __ns:=/left"),
        ("help", "resume"),
        ("completions zsh", "reconfigure"),
        ("man", "TH dq_servo"),
        ("goal --help", "dq_servo/status"),
        ("help goal", "--keep-going"),
        ("help param dump", "--params-file"),
        ("param --help", "dq_servo param load"),
        ("servo --help", "forward_velocity_controller/commands"),
        ("servo --help", "limits.joint_acceleration"),
        ("servo --help", "--ros-args"),
        ("dual --help", "relative_goal"),
        ("puma560 --help", "~/reset"),
    ] {
        let output = dq_servo(arguments).assert().success().get_output().clone();
        let text = String::from_utf8(output.stdout).unwrap();
        assert!(text.contains(said) && output.stderr.is_empty(), "{arguments}: {text}");
    }
}
