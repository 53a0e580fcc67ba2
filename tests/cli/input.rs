//! Tests that bad input and a bad environment lead to an exit code and one line that names the cause.

use crate::{dq_servo, run};
use assert_cmd::Command;
use serde_json::Value;
use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt;
use std::process::Stdio;
use std::time::Duration;

/// Returns the line that an error prints. The code must be 2, and there must be no results.
#[track_caller]
fn refused(command: &mut Command) -> String {
    let output = command.assert().code(2).get_output().clone();
    let message = String::from_utf8(output.stderr).unwrap();
    assert!(message.lines().count() == 1 && output.stdout.is_empty(), "{message}");
    message
}

/// Each line of the file is a command and a part of its error message.
#[test]
fn bad_input_gets_code_2_and_one_line_that_names_it() {
    for case in include_str!("bad_input.txt").lines() {
        let (arguments, named) = case.split_once(" => ").unwrap();
        let message = refused(dq_servo(arguments).timeout(Duration::from_secs(20)));
        assert!(message.contains(named), "{arguments}: {message}");
    }
}

#[test]
fn negative_numbers_are_numbers_however_they_are_written() {
    let pose = |joints: &str| {
        dq_servo(&format!("pose --json {joints}")).assert().success().get_output().stdout.clone()
    };
    assert_eq!(pose("-.5 -6.1e-17 -1e-1 -2E+0 -1. 0"), pose("-0.5 -0.000000000000000061 -0.1 -2 -1.0 -0"));
}

#[test]
fn a_described_arm_takes_no_values_of_the_built_in_one() {
    let output = dq_servo("pose 0 0 --json --ros-args --params-file tests/data/arms/planar.yaml")
        .assert()
        .success()
        .get_output()
        .clone();
    let pose: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(pose["position"], serde_json::json!([0.75, 0.0, 0.0]));
    assert!(output.stderr.is_empty());
}

#[test]
fn an_arm_is_taken_from_a_robot_description_or_is_built_in() {
    let theta = "0.1 -0.4 0.2 -2.0 0.3 1.5 0.7";
    let pose = |arguments: &str| -> Value {
        let output = dq_servo(arguments).assert().success().get_output().stdout.clone();
        serde_json::from_slice(&output).unwrap()
    };
    let frames = "-p base_frame:=panda_link0 -p tool_frame:=panda_link8";
    let described = pose(&format!(
        "pose --json --ros-args -p robot_file:=tests/data/urdf/panda.urdf {frames} -- {theta}"
    ));
    let boxed = pose(&format!("pose --json --arm panda {theta}"));
    for key in ["position", "orientation_xyzw"] {
        let numbers = |pose: &Value| -> Vec<f64> { serde_json::from_value(pose[key].clone()).unwrap() };
        for (one, other) in numbers(&described).iter().zip(numbers(&boxed)) {
            assert!((one - other).abs() < 1e-9, "{described} {boxed}");
        }
    }
    let text = std::fs::read_to_string("tests/data/urdf/panda.urdf").unwrap();
    let mut command =
        dq_servo("pose --json --ros-args -p base_frame:=panda_link0 -p tool_frame:=panda_link8");
    command.arg("-p").arg(format!("robot_description:={text}")).arg("--").args(theta.split(' '));
    let given: Value = serde_json::from_slice(&command.assert().success().get_output().stdout).unwrap();
    assert_eq!(given, described);
}

#[test]
fn unknown_parameters_and_sections_are_reported_and_ignored() {
    for (file, said) in [
        ("shared.yaml", "/dq_servo has no parameter \"nope\": ignored"),
        (
            "servo.yaml",
            "none of its sections (servo) is for /dq_servo: nothing is taken from it (did you mean dq_servo?)",
        ),
    ] {
        let file = format!("tests/data/arms/{file}");
        let output =
            dq_servo(&format!("pose 0 0 0 0 0 0 --ros-args --params-file {file}")).assert().success();
        let message = String::from_utf8(output.get_output().stderr.clone()).unwrap();
        assert_eq!(message.trim_end(), format!("warning: {file}: {said}"));
    }
}

#[test]
fn a_pipe_as_a_parameter_file_is_not_waited_for() {
    let directory = tempfile::tempdir().unwrap();
    let pipe = directory.path().join("pipe");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    for line in ["--params-file PIPE", "-p base_frame:=a -p tool_frame:=b -p robot_file:=PIPE"] {
        let line = format!("pose 0 --ros-args {}", line.replace("PIPE", &pipe.to_string_lossy()));
        let message = refused(dq_servo(&line).timeout(Duration::from_secs(20)));
        assert!(message.contains("pipe: it is not a regular file"), "{message}");
    }
}

#[test]
fn an_empty_section_of_this_node_causes_no_warning() {
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(&file, "dq_servo:\n  ros__parameters:\n").unwrap();
    let line = format!("pose 0 0 0 0 0 0 --ros-args --params-file {}", file.path().display());
    let output = dq_servo(&line).assert().success().get_output().clone();
    assert_eq!(String::from_utf8_lossy(&output.stderr), "");
}

#[test]
fn bad_environment_gets_code_2_and_one_line() {
    for (variable, value) in [
        ("ROS_DOMAIN_ID", "999"),
        ("ROS_LOCALHOST_ONLY", "maybe"),
        ("ROS_AUTOMATIC_DISCOVERY_RANGE", "FAR"),
        ("ROS_SECURITY_ENABLE", "True"),
    ] {
        let message = refused(dq_servo("servo").env(variable, value));
        assert!(message.contains(variable) && message.contains(value), "{message}");
    }
}

#[test]
fn arguments_and_variables_that_are_not_utf_8_are_rejected_by_name() {
    let other = OsStr::from_bytes(b"tr\xffue");
    for arguments in [vec![other], vec![OsStr::new("servo"), OsStr::new("--ros-args"), other]] {
        let (code, message) = run(&arguments, Stdio::piped(), Stdio::piped());
        assert_eq!(code, Some(2));
        assert!(message.contains("not UTF-8") && message.lines().count() == 1, "{message}");
    }
    for variable in ["ROS_DOMAIN_ID", "ROS_LOCALHOST_ONLY", "ROS_SECURITY_ENABLE", "ROS_SECURITY_KEYSTORE"] {
        let message = refused(dq_servo("servo").env(variable, other));
        assert!(message.contains(variable) && message.contains("UTF-8"), "{message}");
    }
}

#[test]
fn no_command_runs_unsecured_where_security_was_asked_for() {
    for arguments in [
        "servo",
        "dual",
        "puma560",
        "demo",
        "record --out bag",
        "param list",
        "goal 0 0 0 0 0 0 1",
        "param set controller diffc",
        "stop --all",
        "status",
    ] {
        let message = refused(dq_servo(arguments).env("ROS_SECURITY_ENABLE", "true"));
        let expected = match cfg!(feature = "security") {
            true => "the folder of a keystore",
            false => "built without security",
        };
        assert!(message.contains(expected), "{arguments}: {message}");
    }
}

#[test]
fn a_usage_error_waits_for_no_node() {
    let started = std::time::Instant::now();
    dq_servo("param set controller logc extra").assert().code(2);
    assert!(started.elapsed() < std::time::Duration::from_secs(3));
}
