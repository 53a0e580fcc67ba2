//! The command line without DDS: what it prints, and how it answers bad input.
#![cfg(feature = "tools")]

use assert_cmd::Command;
use serde_json::Value;
use std::ffi::OsStr;
use std::fs::File;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::PermissionsExt;
use std::process::Stdio;

fn dq_servo(arguments: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_dq_servo"));
    command.args(arguments.split_whitespace()).env_remove("ROS_DOMAIN_ID");
    command
}

const THETA_INITIAL: &str = "0.7853981633974483 1.0471975511965976 2.356194490192345 0.5235987755982988 \
                             -0.7853981633974483 2.0943951023931953";

#[test]
fn pose_prints_the_paper_s_dual_quaternion() {
    let output =
        dq_servo(&format!("pose --json {THETA_INITIAL}")).assert().success().get_output().stdout.clone();
    let pose: Value = serde_json::from_slice(&output).unwrap();
    let reference: Value = serde_json::from_str(include_str!("data/reference.json")).unwrap();
    let numbers =
        |value: &Value| value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect::<Vec<_>>();
    let (ours, printed) = (numbers(&pose["dual_quaternion"]), numbers(&reference["printed"]["q_initial"]));
    assert!(ours.iter().zip(&printed).all(|(a, b)| (a - b).abs() < 1e-12), "{ours:?}");
    let xyzw = numbers(&pose["orientation_xyzw"]);
    assert_eq!(xyzw, [ours[1], ours[2], ours[3], ours[0]]);
    assert_eq!(numbers(&pose["position"]).len(), 3);
}

#[test]
fn pose_prints_a_line_for_ros2_topic_pub() {
    let output = dq_servo(&format!("pose {THETA_INITIAL}")).assert().success().get_output().stdout.clone();
    let text = String::from_utf8(output).unwrap();
    let (_, message) = text.split_once("  \"").unwrap();
    let yaml: Value = serde_saphyr::from_str(message.trim_end().trim_end_matches('"')).unwrap();
    assert_eq!(yaml["header"]["frame_id"], "base_link");
    assert!((yaml["pose"]["position"]["x"].as_f64().unwrap() - 0.1303602522913436).abs() < 1e-12);
}

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
        ("pose 1 --ros-args -p tool_frame:=tool0 -p robot_file:=tests/data/urdf/ur5.urdf", "base_frame"),
        (
            "pose 1 --ros-args -p tool_frame:=tool9 -p base_frame:=base_link -p robot_file:=tests/data/urdf/ur5.urdf",
            "tests/data/urdf/ur5.urdf: tool_frame is \"tool9\"",
        ),
        (
            "pose 1 --ros-args -p tool_frame:=panda_leftfinger -p base_frame:=panda_link0 -p robot_file:=tests/data/urdf/nope.urdf",
            "nope.urdf: No such file",
        ),
        ("pose 1 2 3 4 5 x", "'x'"),
        ("pose 1 2 3 4 5 nan", "NaN"),
        ("goal 1 2 3", "7"),
        ("goal 0 0 0 0 0 0 2", "norm 2"),
        ("goal 0 0 inf 0 0 0 1", "position is inf"),
        ("goal 0 0 0 0 0 0 1 --timeout -1", "--timeout"),
        ("param get", "NAME"),
        ("param set controller", "VALUE"),
        ("param set controller [", "\"[\""),
        ("param get no//de x", "no//de"),
        ("record", "--output"),
        ("record -o bag --max-size 0", "0"),
        ("record -o bag --max-duration 0", "--max-duration"),
        ("record -o bag --topics a//b", "a//b"),
        ("servo --ros-args --params-file nothing.yaml", "nothing.yaml"),
        ("servo --ros-args --params-file Cargo.toml", "Cargo.toml"),
        ("servo --ros-args -p dq_servo:controler:=diffc", "did you mean \"controller\"?"),
        ("servo --ros-args -p controller:=pid", "one of diffc, diffc_inverse, logc"),
        ("servo --ros-args -p diffc.gain:=fast", "is a double"),
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
        ("dual --ros-args -p primitive:=relative", "one of relative_position, relative_orientation"),
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
fn an_arm_is_taken_from_a_robot_description_or_from_the_box() {
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
        (
            format!("{file}/shared.yaml"),
            "shared.yaml: /dq_servo has no parameter \"nope\", \"diffc.gian\" (did you mean \"diffc.gain\"?): ignored",
        ),
        (
            format!("{file}/servo.yaml"),
            "servo.yaml: none of its sections (servo) is for /dq_servo: nothing is taken from it (did you mean dq_servo?)",
        ),
        (
            "pose 0 0 0 0 0 0 --ros-args -p nope:=5".to_owned(),
            "-p nope:=5: /dq_servo has no parameter \"nope\": ignored",
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

/// The code, and what came on stderr if that can be read.
fn run(arguments: &[&OsStr], stdout: impl Into<Stdio>, stderr: impl Into<Stdio>) -> (Option<i32>, String) {
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_dq_servo"));
    let command = command.args(arguments).env_remove("ROS_DOMAIN_ID").env("RUST_BACKTRACE", "0");
    let output = command.stdout(stdout).stderr(stderr).spawn().unwrap().wait_with_output().unwrap();
    (output.status.code(), String::from_utf8(output.stderr).unwrap())
}

fn words(line: &str) -> Vec<&OsStr> {
    line.split_whitespace().map(OsStr::new).collect()
}

/// What prints, each in its own way.
const PRINTING: [&str; 5] =
    ["pose 1 2 3 4 5 6", "pose --json 1 2 3 4 5 6", "--help", "goal --help", "--version"];

#[test]
fn a_full_disk_fails_with_one_line() {
    for arguments in PRINTING {
        let full = || File::create("/dev/full").unwrap();
        let (code, message) = run(&words(arguments), full(), Stdio::piped());
        assert_eq!(code, Some(1), "{arguments}");
        assert!(message.starts_with("error: stdout") && message.contains("No space left"), "{message}");
        assert_eq!(message.lines().count(), 1, "{message}");
        assert_eq!(run(&words(arguments), full(), full()).0, Some(1), "{arguments}");
    }
    assert_eq!(run(&words("pose 1"), Stdio::null(), File::create("/dev/full").unwrap()).0, Some(2));
}

#[test]
fn a_reader_that_has_seen_enough_is_no_failure() {
    let broken = || std::io::pipe().unwrap().1;
    for arguments in PRINTING {
        assert_eq!(run(&words(arguments), broken(), Stdio::piped()), (Some(0), String::new()), "{arguments}");
    }
    assert_eq!(run(&words("pose 1"), broken(), broken()).0, Some(2), "and an error stays one");
}

#[test]
fn closed_streams_change_no_code() {
    for (arguments, code) in [("pose 1 2 3 4 5 6", 0), ("--help", 0), ("pose 1", 2), ("--frob", 2)] {
        let closed = format!("{} {arguments} <&- >&- 2>&-", env!("CARGO_BIN_EXE_dq_servo"));
        Command::new("sh").args(["-c", &closed]).assert().code(code);
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
fn where_no_thread_can_be_had_one_line_says_so() {
    for arguments in ["servo", "puma560", "param list", "goal 0 0 0 0 0 0 1", "reproduce --out /nowhere"] {
        // As `ulimit -u` does it, for root too: no thread gets a stack of that size.
        let output = dq_servo(arguments)
            .env("RUST_MIN_STACK", "100000000000000")
            .assert()
            .code(1)
            .get_output()
            .clone();
        let message = String::from_utf8(output.stderr).unwrap();
        assert!(message.contains("Resource temporarily unavailable"), "{arguments}: {message}");
        assert_eq!(message.lines().count(), 1, "{message}");
    }
}

#[cfg(not(feature = "security"))]
#[test]
fn a_program_built_without_security_never_runs_where_it_was_asked_for() {
    for arguments in [
        "servo",
        "dual",
        "puma560",
        "demo",
        "record -o bag",
        "param list",
        "goal 0 0 0 0 0 0 1",
        "param set controller diffc",
        "stop --all",
        "status",
    ] {
        let output =
            dq_servo(arguments).env("ROS_SECURITY_ENABLE", "true").assert().code(2).get_output().clone();
        let message = String::from_utf8(output.stderr).unwrap();
        assert!(
            message.contains("built without security") && message.lines().count() == 1,
            "{arguments}: {message}"
        );
    }
}

#[test]
fn help_and_version_are_no_errors() {
    dq_servo("--version").assert().success();
    for (arguments, said) in [
        ("--help", "-r __ns:=/left"),
        ("help", "resume"),
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

#[test]
fn a_usage_error_waits_for_no_node() {
    let started = std::time::Instant::now();
    dq_servo("param set controller logc extra").assert().code(2);
    assert!(started.elapsed() < std::time::Duration::from_secs(3));
}

#[test]
fn what_ros2_launch_needs_compiles_and_the_scripts_say_what_they_miss() {
    for name in ["dq_servo", "dq_dual_servo"] {
        let compile = format!("compile(open('launch_scripts/{name}.launch.py').read(), 'launch', 'exec')");
        Command::new("python3").args(["-c", &compile]).assert().success();
        Command::new(script(name))
            .env("DQ_SERVO", "/nonexistent")
            .env("PATH", "/usr/bin:/bin")
            .assert()
            .code(2);
    }
}

fn script(name: &str) -> String {
    format!("{}/launch_scripts/{name}.sh", env!("CARGO_MANIFEST_DIR"))
}

#[test]
fn the_scripts_have_their_own_help_and_end_with_the_code_of_the_part_that_failed() {
    for name in ["dq_servo", "dq_dual_servo"] {
        let help = Command::new(script(name)).arg("--help").assert().success().get_output().stdout.clone();
        assert!(String::from_utf8(help).unwrap().starts_with("Starts "));
        // The part that fails is the first to start, then the last.
        for failing in ["puma560", "servo|dual"] {
            let folder = tempfile::tempdir().unwrap();
            let program = folder.path().join("dq_servo");
            let ended = folder.path().join("ended");
            // It fails once the others can be asked to end.
            let parts = format!(
                "#!/bin/sh\ntrap 'kill $!; echo $1 >>{}; exit 0' TERM\nsleep 10 &\ncase $1 in {failing}) sleep 0.3; kill $!; exit 7 ;; esac\nwait\n",
                ended.display()
            );
            std::fs::write(&program, parts).unwrap();
            std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o755)).unwrap();
            let mut command = Command::new(script(name));
            command.env("DQ_SERVO", &program).timeout(std::time::Duration::from_secs(10)).assert().code(7);
            assert!(!std::fs::read_to_string(ended).unwrap().is_empty(), "the others were ended");
        }
    }
}

#[test]
fn reproduce_writes_every_figure_and_number() {
    let folder = std::env::temp_dir().join(format!("dq_servo_reproduce_{}", std::process::id()));
    let constants = include_str!("../msg_config/paper.yaml").replace("pairs: 2000", "pairs: 8");
    std::fs::create_dir_all(&folder).unwrap();
    let file = folder.join("quick.yaml");
    std::fs::write(&file, constants).unwrap();
    let out = folder.join("new/folder");
    let arguments = format!("reproduce --out {} --experiment {}", out.display(), file.display());
    let output = dq_servo(&arguments).assert().success().get_output().clone();
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.contains("double_geodesic") && text.contains("diffc overshoots its goal: holds"), "{text}");
    assert!(output.stderr.is_empty(), "no terminal, no progress");
    let results: Value = serde_json::from_slice(&std::fs::read(out.join("results.json")).unwrap()).unwrap();
    let names: Vec<_> = results["figures"].as_object().unwrap().keys().collect();
    assert_eq!(names.len(), 14);
    for name in names {
        let svg = std::fs::read_to_string(out.join(format!("{name}.svg"))).unwrap();
        assert!(svg.starts_with("<svg") && svg.matches("<polyline").count() > 5, "{name}");
        let png = std::fs::read(out.join(format!("{name}.png"))).unwrap();
        assert!(png.starts_with(b"\x89PNG\r\n\x1a\n") && png.len() > 10_000, "{name}");
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn reproduce_answers_bad_constants_and_places_with_one_line() {
    for (arguments, code, named) in [
        ("reproduce --experiment nothing.yaml", 2, "nothing.yaml"),
        ("reproduce --experiment msg_config/topics.yaml", 2, "topics.yaml"),
        ("reproduce --experiment msg_config/paper.yaml --out /proc/nowhere", 1, "/proc/nowhere"),
        ("reproduce --frob", 2, "--frob"),
    ] {
        let output = dq_servo(arguments).assert().code(code).get_output().clone();
        let message = String::from_utf8(output.stderr).unwrap();
        assert!(message.contains(named) && message.lines().count() == 1, "{arguments}: {message}");
    }
}
