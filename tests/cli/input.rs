//! Bad input and a bad environment: a code and one line that names it.

use crate::{dq_servo, run};
use serde_json::Value;
use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt;
use std::process::Stdio;

#[test]
fn bad_input_gets_code_2_and_one_line_that_names_it() {
    for (arguments, named) in [
        ("--bogus", "--bogus"),
        ("fly", "fly"),
        ("gaol", "'goal'"),
        ("servo --frob", "(see dq_servo servo --help)"),
        ("param sett controller diffc", "'set'"),
        ("param get", "(see dq_servo param get --help)"),
        ("goal 1 2 3", "(see dq_servo goal --help)"),
        (
            "param set controller logc extra",
            "\"controller\" is a parameter, not a node: param set [NODE] NAME VALUE",
        ),
        ("param get controller logc", "\"controller\" is a parameter, not a node"),
        ("param load nothing.yaml", "nothing.yaml"),
        ("param load tests/data/arms/servo.yaml", "has nothing for /dq_servo: its sections are [\"/servo\"]"),
        ("stop --all /dq_servo", "--all"),
        ("pause no//de", "no//de"),
        ("replay bag --ros-args -p controller:=diffc", "replay takes no ROS arguments"),
        ("pose 1 2 3", "got 3 joint values, expected 6"),
        ("pose 1 --arm ur6e", "ur5e"),
        ("pose 1 --ros-args -p tool_frame:=tool0", "robot_description or robot_file"),
        ("demo tests/data/urdf/ur5.urdf --arm ur5e", "cannot be used with"),
        ("servo tests/data/urdf/nope.urdf", "nope.urdf: No such file"),
        (
            "pose 1 --ros-args -p tool_frame:=tool9 -p base_frame:=base_link -p robot_file:=tests/data/urdf/ur5.urdf",
            "tests/data/urdf/ur5.urdf: tool_frame is \"tool9\"",
        ),
        (
            "pose 1 --ros-args -p tool_frame:=panda_leftfinger -p base_frame:=panda_link0 -p robot_file:=tests/data/urdf/nope.urdf",
            "nope.urdf: No such file",
        ),
        (
            "compare --out c --tasks -1",
            "invalid value '-1' for '--tasks <N>': expected a whole number from 1 to 10000000 (see",
        ),
        ("compare --out c --tasks x", "'--tasks <N>': expected a whole number from 1 to 10000000 (see"),
        ("compare --out c --seed -1", "'--seed <N>': expected a whole number from 0 on (see"),
        (
            "record --out bag --max-size -1",
            "'--max-size <BYTES>': expected a whole number from 1048576 on (see",
        ),
        ("record --out bag --max-duration -1", "--max-duration -1.0: expected seconds, 0.1 or more"),
        ("record --max", "unexpected argument '--max' found; tip: a similar argument exists"),
        ("compare --out c --reconfigure --constraints", "cannot be used with '--constraints'"),
        ("compare --out c --arm nope", "nope: no built-in arm (puma560, ur3e,"),
        ("param", "a subcommand is missing (see dq_servo param --help)"),
        ("param set", "expected param set [NODE] NAME VALUE, got [] (see dq_servo param set --help)"),
        ("param set controller", "expected param set [NODE] NAME VALUE, got [\"controller\"]"),
        ("param list a b", "expected param list [NODE], got [\"a\", \"b\"]"),
        ("pose 1 2 3 4 5 x", "'x'"),
        ("pose 1 2 3 4 5 nan", "NaN"),
        ("goal 1 2 3", "7"),
        ("goal 0 0 0 0 0 0 2", "norm 2"),
        ("goal 0 0 inf 0 0 0 1", "position is inf"),
        ("goal -.3 -6.1e-17 -1e-5 -1E+0 -2. 0 2", "norm 3"),
        (
            "goal 0.3 -6.1e-17 0.2 0 0 0 1 --recrod bag",
            "'--recrod' found; tip: a similar argument exists: '--record'",
        ),
        ("goal 0.3 -6.1e-17 0.2 0 0 0 1 -x", "unexpected argument '-x' found"),
        ("goal 0 0 0 0 0 0 1 --timeout -1", "--timeout -1.0: expected seconds, 0 or more"),
        ("goal 0 0 0 0 0 0 1 --timeout -1e-3", "--timeout -0.001: expected seconds, 0 or more"),
        ("param get", "NAME"),
        ("param set controller", "VALUE"),
        ("param set controller [", "\"[\""),
        ("param get no//de x", "no//de"),
        ("record", "--out"),
        ("record --out bag --max-size 0", "0"),
        ("record --out bag --max-duration 0", "--max-duration"),
        ("record --out bag --topics a//b", "a//b"),
        ("view --listen nowhere", "cannot listen on nowhere"),
        ("servo --ros-args --params-file nothing.yaml", "nothing.yaml"),
        ("servo --ros-args --params-file Cargo.toml", "Cargo.toml"),
        ("servo --ros-args -p dq_servo:controler:=diffc", "did you mean \"controller\"?"),
        ("servo --ros-args -p controler:=diffc", "did you mean \"controller\"?"),
        ("puma560 --ros-args -p gains.difc:=3", "did you mean \"gains.diffc\"?"),
        ("pose 0 --ros-args -p limits.joint_velocty:=[1.0]", "did you mean \"limits.joint_velocity\"?"),
        (
            "pose 0 --ros-args --params-file tests/data/arms/misspelt.yaml",
            "did you mean \"limits.joint_velocity\"?",
        ),
        (
            "pose 0 --ros-args --params-file tests/data/arms/spelt_twice.yaml",
            "spelt_twice.yaml: parameter \"limits.linear_speed\" of \"/dq_servo\" is given twice",
        ),
        ("pose 0 --ros-args --params-file /dev/zero", "/dev/zero: it is no regular file"),
        (
            "pose 0 --ros-args -p base_frame:=a -p tool_frame:=b -p robot_file:=/dev/zero",
            "/dev/zero: it is no regular file",
        ),
        ("param load /dev/zero", "/dev/zero: it is no regular file"),
        ("goal 0 0 0 0.73 -0.46 0.28 0.44", "norm 1.008"),
        ("servo --ros-args -p controller:=pid", "one of diffc, diffc_inverse, logc"),
        ("servo --ros-args -p gains.diffc:=fast", "is a double"),
        ("servo --ros-args -p limits.joint_velocity:=[1.0,2.0]", "6 numbers"),
        (
            "servo --ros-args -p joints:=[a,b]",
            "arm.convention, arm.alpha, arm.a, arm.d, limits.joint_velocity",
        ),
        (
            "puma560 --ros-args -p arm.a:=[0.1]",
            "an arm needs joints, arm.convention, arm.alpha, arm.d, initial_positions too",
        ),
        ("dual --ros-args --params-file tests/data/arms/without_a.yaml", "an arm needs arm.a too"),
        ("pose 0 0 0 0 0 0 --ros-args -p nope:=5", "unknown parameter \"nope\""),
        ("pose 0 0 --ros-args --params-file tests/data/arms/without_a.yaml", "an arm needs arm.a too"),
        ("plot bag --ros-args --params-file tests/data/arms/without_a.yaml", "an arm needs arm.a too"),
        ("reproduce --ros-args --params-file tests/data/arms/without_a.yaml", "an arm needs arm.a too"),
        (
            "pose 0 0 --ros-args --params-file tests/data/arms/degrees.yaml",
            "-90: expected radians, -2π to 2π (are these degrees?)",
        ),
        ("pose 0 0 --ros-args --params-file tests/data/arms/twice.yaml", "\"shoulder\""),
        ("servo --ros-args -p update_rate:=fast", "is an integer"),
        ("servo --ros-args -p update_rate:=0", "1 to 2000 Hz"),
        ("servo --ros-args -r a=b", "a=b"),
        ("servo --ros-args -r __node:=a/b", "a/b"),
        ("servo --ros-args --log-level loud", "loud"),
        ("puma560 --ros-args -p initial_positions:=[1]", "initial_positions"),
        ("puma560 --ros-args --frob", "--frob"),
        ("dual --ros-args -p primitive:=relative", "one of relative_pose, relative_position"),
        ("dual --ros-args -p controller:=logc", "one of transpose, damped_inverse"),
        ("dual --ros-args -p right_base:=[0.0,1.0]", "7 numbers"),
        ("dual --ros-args -p right_base:=[0.0,0.0,0.0,0.0,0.0,0.0,2.0]", "norm 2"),
    ] {
        let output = dq_servo(arguments)
            .timeout(std::time::Duration::from_secs(20))
            .assert()
            .code(2)
            .get_output()
            .clone();
        let message = String::from_utf8(output.stderr).unwrap();
        assert!(message.contains(named) && message.lines().count() == 1, "{arguments}: {message}");
        assert!(output.stdout.is_empty(), "{arguments}");
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
fn a_described_arm_takes_nothing_of_the_built_in_one() {
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
fn what_no_node_of_ours_takes_is_said_and_passed_over() {
    let file = "pose 0 0 0 0 0 0 --ros-args --params-file tests/data/arms";
    for (arguments, named) in [
        (format!("{file}/shared.yaml"), "shared.yaml: /dq_servo has no parameter \"nope\": ignored"),
        (
            format!("{file}/servo.yaml"),
            "servo.yaml: none of its sections (servo) is for /dq_servo: nothing is taken from it (did you mean dq_servo?)",
        ),
    ] {
        let output = dq_servo(&arguments).assert().success().get_output().clone();
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(
            message.trim_end(),
            format!(
                "warning: {}",
                named
                    .replace("shared.yaml:", "tests/data/arms/shared.yaml:")
                    .replace("servo.yaml:", "tests/data/arms/servo.yaml:")
            )
        );
    }
}

#[test]
fn nobody_waits_for_a_pipe_that_is_to_be_a_parameter_file() {
    let directory = tempfile::tempdir().unwrap();
    let pipe = directory.path().join("pipe");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    for line in ["--params-file PIPE", "-p base_frame:=a -p tool_frame:=b -p robot_file:=PIPE"] {
        let line = format!("pose 0 --ros-args {}", line.replace("PIPE", &pipe.to_string_lossy()));
        let output = dq_servo(&line).timeout(std::time::Duration::from_secs(20)).assert().code(2);
        let message = String::from_utf8(output.get_output().stderr.clone()).unwrap();
        assert!(message.contains("pipe: it is no regular file") && message.lines().count() == 1, "{message}");
    }
}

#[test]
fn a_section_of_this_node_that_is_empty_is_nothing_to_warn_of() {
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
        let output = dq_servo("servo").env(variable, value).assert().code(2).get_output().clone();
        let message = String::from_utf8(output.stderr).unwrap();
        assert!(
            message.contains(variable) && message.contains(value) && message.lines().count() == 1,
            "{message}"
        );
    }
}

#[test]
fn what_is_not_utf_8_is_named_and_never_passed_over() {
    let other = OsStr::from_bytes(b"tr\xffue");
    for arguments in [vec![other], vec![OsStr::new("servo"), OsStr::new("--ros-args"), other]] {
        let (code, message) = run(&arguments, Stdio::piped(), Stdio::piped());
        assert_eq!(code, Some(2));
        assert!(message.contains("not UTF-8") && message.lines().count() == 1, "{message}");
    }
    for variable in ["ROS_DOMAIN_ID", "ROS_LOCALHOST_ONLY", "ROS_SECURITY_ENABLE", "ROS_SECURITY_KEYSTORE"] {
        let output = dq_servo("servo").env(variable, other).assert().code(2).get_output().clone();
        let message = String::from_utf8(output.stderr).unwrap();
        assert!(message.contains(variable) && message.contains("UTF-8"), "{message}");
        assert_eq!(message.lines().count(), 1, "{message}");
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
        let output =
            dq_servo(arguments).env("ROS_SECURITY_ENABLE", "true").assert().code(2).get_output().clone();
        let message = String::from_utf8(output.stderr).unwrap();
        let refused = match cfg!(feature = "security") {
            true => "the folder of a keystore",
            false => "built without security",
        };
        assert!(message.contains(refused) && message.lines().count() == 1, "{arguments}: {message}");
    }
}

#[test]
fn a_usage_error_waits_for_no_node() {
    let started = std::time::Instant::now();
    dq_servo("param set controller logc extra").assert().code(2);
    assert!(started.elapsed() < std::time::Duration::from_secs(3));
}
