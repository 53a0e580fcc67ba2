//! Tests a robot that publishes its description: the servo takes its arm from the topic.

use crate::host::{Host, assert_success, wait_until};
use crate::replay::{assert_replays, place};
use dq_config::{NodeParameters, PlantParameters};
use dq_params::{ParameterOverride, Value};
use std::fs::File;
use std::path::Path;
use std::time::{Duration, Instant};

const FRAMES: [&str; 5] = ["--ros-args", "-p", "base_frame:=base_link", "-p", "tool_frame:=arm_tool_link"];
const TIAGO: &str = concat!("robot_file:=", env!("CARGO_MANIFEST_DIR"), "/tests/data/urdf/tiago.urdf");

fn of_tiago<'a>(command: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    [&[command][..], &FRAMES, more].concat()
}

/// Returns the start position of the plant.
fn start() -> Vec<f64> {
    let values = TIAGO
        .split_once(":=")
        .into_iter()
        .chain([("base_frame", "base_link"), ("tool_frame", "arm_tool_link")]);
    let given =
        values.map(|(name, value)| ParameterOverride::new(name, Value::String(value.to_owned()), "test"));
    let (store, _) = PlantParameters::start("/arm", given.collect()).unwrap();
    PlantParameters::from_store(&store).unwrap().initial_positions
}

/// Waits until the file has the text.
#[track_caller]
pub fn wait_for_text(file: &str, text: &str) {
    wait_until(|| std::fs::read_to_string(file).unwrap().contains(text).then_some(()));
}

/// Moves to the tool pose that `pose` prints, and records the motion.
fn go_and_record(host: &Host, pose: &[&str], bag: &Path) {
    let pose: serde_json::Value = serde_json::from_str(&host.output(pose)).unwrap();
    let numbers = ["position", "orientation_xyzw"].map(|key| pose[key].as_array().unwrap().clone()).concat();
    let numbers: Vec<_> = numbers.iter().map(ToString::to_string).collect();
    let numbers: Vec<_> = numbers.iter().map(String::as_str).collect();
    host.output(&[&["goal"][..], &numbers, &["--record", bag.to_str().unwrap()]].concat());
}

#[test]
fn a_guard_waits_for_the_description_too_and_takes_its_joints_from_it() {
    let mut host = Host::new();
    let log = host.file("guard.log", "");
    host.start_logging_to("guard", &of_tiago("guard", &[]), File::create(&log).unwrap());
    wait_for_text(&log, "nothing on /robot_description describes it yet");
    assert!(!std::fs::read_to_string(&log).unwrap().contains("watching"));
    host.start("plant", &of_tiago("arm", &["-p", TIAGO]));
    wait_for_text(&log, "watching /forward_velocity_controller/commands");
    let lost = host.run(&of_tiago("guard", &["-r", "__node:=lost", "-p", "tool_frame:=nowhere"]));
    let why = String::from_utf8_lossy(&lost.stderr);
    let expected = "error: what came on /robot_description does not describe the arm: robot_description: tool_frame is \"nowhere\"";
    assert!(lost.status.code() == Some(1) && why.contains(expected), "{why}");
    assert!(host.output(&["param", "get", "dq_servo_guard", "joints"]).contains("torso_lift_joint"));
}

#[test]
fn the_demo_of_a_described_arm_names_it_by_what_it_is_and_its_joints_by_their_units() {
    let host = Host::new();
    let scara = concat!("robot_file:=", env!("CARGO_MANIFEST_DIR"), "/tests/data/urdf/scara.urdf");
    let frames = ["--ros-args", "-p", "base_frame:=link0", "-p", "tool_frame:=tool", "-p", scara];
    let (_directory, bag) = place();
    let bag = bag.to_str().unwrap();
    let start = ["-p", "initial_positions:=[0.1, 0.5, 0.1, -0.4]"];
    let demo = host.run(&[&["demo", "--record", bag][..], &frames, &start].concat());
    let stderr = String::from_utf8_lossy(&demo.stderr);
    assert!(stderr.contains("[arm]: simulating 4 joints") && !stderr.contains("puma560"), "{stderr}");
    assert!(stderr.contains("\"quill\" at -0.4 m, below -0.3 m"), "{stderr}");
    // The return motion ends at the limit.
    assert!(stderr.contains("quill is at its position limit"), "{stderr}");
    let plot = host.run(&["plot", bag, "--out", &format!("{bag}_plots")]);
    assert_success(&plot);
    let table = String::from_utf8_lossy(&plot.stdout);
    assert!(table.contains("rad²/s,") && table.contains("m²/s"), "{table}");
}

#[test]
fn the_servo_waits_for_the_description_and_moves_the_arm_that_it_has() {
    let mut host = Host::new();
    let log = host.file("servo.log", "");
    let logged = |text: &str| wait_for_text(&log, text);
    host.start_logging_to("servo", &of_tiago("servo", &[]), File::create(&log).unwrap());
    logged("nothing on /robot_description describes it yet");
    host.start("plant", &of_tiago("arm", &["-p", TIAGO]));
    logged("waiting_for_state -> holding");
    assert!(host.parameter("joints").contains("torso_lift_joint"));
    assert!(host.parameter("limits.joint_velocity").contains("0.07"));
    let in_force = host.parameter("robot_description");
    assert!(in_force.contains("torso_lift_joint") && !in_force.contains("wheel"), "{in_force}");
    assert!(in_force.starts_with("<robot") && in_force.lines().count() > 1, "a text as it is: {in_force}");
    let theta: Vec<_> = start().iter().map(|position| (position + 0.05).to_string()).collect();
    let theta: Vec<_> = theta.iter().map(String::as_str).collect();
    let (_directory, bag) = place();
    go_and_record(&host, &[&["pose", "--json"][..], &FRAMES, &["-p", TIAGO, "--"], &theta].concat(), &bag);
    assert!(assert_replays(&bag) > 100, "by the joints of the description that the bag has");

    // The description of another robot changes nothing, and neither does an invalid one.
    let ur5 = concat!("robot_file:=", env!("CARGO_MANIFEST_DIR"), "/tests/data/urdf/ur5.urdf");
    let other = ["arm", "--ros-args", "-r", "__node:=other", "-r", "joint_states:=other", "-p", ur5];
    let frames = ["-p", "base_frame:=base_link", "-p", "tool_frame:=tool0"];
    host.start("other", &[&other[..], &frames].concat());
    logged("the description on /robot_description is not used");
    // A text of 4 MB of ampersands does not delay requests for parameters either.
    host.peer(&["odd_description"]);
    let began = Instant::now();
    assert_eq!(host.parameter("controller"), "logc");
    assert!(began.elapsed() < Duration::from_secs(10), "{:?}", began.elapsed());
    assert!(host.parameter("joints").contains("torso"));
}

/// Names of links and joints with quotes, blanks, slashes, commas and characters that are not ASCII.
const NAMES: [&str; 8] = [
    "base \"link\", 0",
    "joint 1",
    "l\u{e9}ft/arm, 'a'",
    "joint\u{a0}2 # not: a comment",
    "[fore] {arm}; \\n",
    "\u{5173}\u{8282} 0.5 3",
    "hand & <tool>",
    "base",
];

#[test]
fn names_of_any_characters_are_names_over_dds_in_bags_and_in_figures() {
    let [base, one, upper, two, fore, three, hand, other] =
        NAMES.map(|name| name.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;"));
    let joint = |(name, parent, child, origin): (&str, &str, &str, &str)| {
        format!(
            "<joint name=\"{name}\" type=\"revolute\"><parent link=\"{parent}\"/><child link=\"{child}\"/><origin xyz=\"{origin}\"/>\
             <axis xyz=\"0 1 0\"/><limit lower=\"-2\" upper=\"2\" effort=\"1\" velocity=\"1\"/></joint>"
        )
    };
    let joints = [
        (&*one, &*base, &*upper, "0 0 0.2"),
        (&*two, &*upper, &*fore, "0.3 0 0"),
        (&*three, &*fore, &*hand, "0.3 0 0"),
        (&*other, &*base, &*other, "0 0 -1"),
    ];
    let shape = "<collision><geometry><box size=\"0.1 0.05 0.05\"/></geometry></collision>";
    let links =
        [&base, &upper, &fore, &hand, &other].map(|name| format!("<link name=\"{name}\">{shape}</link>"));
    let text =
        format!("<robot name=\"a 'b' &amp; c\">{}{}</robot>", links.concat(), joints.map(joint).concat());
    let mut host = Host::new();
    let file = host.file("robot.urdf", &text);
    let yaml = |text: &str| Value::String(text.to_owned()).to_string();
    let frames = format!(
        "/**:\n  ros__parameters:\n    base_frame: {}\n    tool_frame: {}\n    constraints: true\n",
        yaml(NAMES[0]),
        yaml(NAMES[6])
    );
    let frames = host.file("frames.yaml", &frames);
    let log = host.file("servo.log", "");
    // The servo has the description from the topic.
    host.start_logging_to(
        "servo",
        &["servo", "--ros-args", "--params-file", &frames],
        File::create(&log).unwrap(),
    );
    wait_for_text(&log, "nothing on /robot_description describes it yet");
    let described = format!("robot_file:={file}");
    let start = "initial_positions:=[0.1, 0.5, 0.3]";
    host.start("plant", &["arm", "--ros-args", "--params-file", &frames, "-p", &described, "-p", start]);
    wait_for_text(&log, "waiting_for_state -> holding");
    let param = |name: &str| Value::from_yaml(&host.parameter(name)).unwrap();
    let joints = [NAMES[1], NAMES[3], NAMES[5]];
    assert_eq!(param("joints"), Value::StringArray(joints.map(str::to_owned).to_vec()));
    let Value::StringArray(body) = param("body") else { panic!() };
    // There is a shape on each link of the arm. None of the arm's joints is called base.
    for name in joints.into_iter().chain(["base"]) {
        assert!(body.iter().any(|text| text.starts_with(&format!("{name} "))), "{name:?} in {body:?}");
    }
    let (_directory, bag) = place();
    let pose =
        ["pose", "0.3", "0.4", "0.4", "--json", "--ros-args", "--params-file", &frames, "-p", &described];
    go_and_record(&host, &pose, &bag);
    assert!(assert_replays(&bag) > 50);
    let bag = bag.to_str().unwrap();
    let plots = format!("{bag}_plots");
    assert_success(&host.run(&["plot", bag, "--out", &plots]));
    let figure = std::fs::read_to_string(format!("{plots}/joint_positions.svg")).unwrap();
    assert!(figure.contains(NAMES[1]) && figure.contains(NAMES[3]), "the titles of its panels");
}
