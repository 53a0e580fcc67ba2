//! Tests the page in Debian's Chromium with real nodes, each on its own host.

use crate::host::{Host, assert_success, wait_for_line};
use std::io::{BufRead, BufReader, Read};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

const SCRIPT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/view/browser.mjs");

/// The folder of screenshots.
const SHOTS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/target/view");

/// The modules that control the browser and check accessibility. tests/install.sh installs them.
const MODULES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/target/node");

/// The address of the page on each host.
const PLACE: &str = "http://127.0.0.1:8123/?token=";

/// A token that stays the same when the page is restarted.
const TOKEN: &str = "a-token-for-the-tests-of-the-page";

/// A case of the script. The browser runs on `host`.
struct Browser {
    child: Child,
    lines: Receiver<String>,
}

impl Browser {
    fn start(host: &Host, case: &str, link: &str) -> Self {
        std::fs::create_dir_all(SHOTS).unwrap();
        let mut command = host.command("timeout");
        command.args(["300", "node", SCRIPT, case, link, SHOTS]).env("MODULES", MODULES);
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let (sender, lines) = channel();
        let output = BufReader::new(child.stdout.take().unwrap());
        std::thread::spawn(move || {
            output.lines().map_while(Result::ok).for_each(|line| drop(sender.send(line)))
        });
        Self { child, lines }
    }

    /// Waits until the script has reached `line`.
    fn until(&mut self, line: &str) {
        loop {
            match self.lines.recv_timeout(Duration::from_secs(310)) {
                Ok(said) if said == line => return,
                // Other output says, for example, how evenly the pictures arrive.
                Ok(said) => println!("{said}"),
                Err(_) => {
                    let mut errors = String::new();
                    let _ = self.child.kill();
                    let _ = self.child.stderr.take().unwrap().read_to_string(&mut errors);
                    panic!("{line:?} was not reached: {errors}");
                }
            }
        }
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Opens the page on `host`, and returns the link.
fn view(host: &mut Host, arguments: &[&str]) -> String {
    view_with(host, arguments, TOKEN)
}

fn view_with(host: &mut Host, arguments: &[&str], token: &str) -> String {
    let variables = [("DQ_SERVO_VIEW_TOKEN", token)];
    let link = link(host.start_with("view", &[&["view"], arguments].concat(), &variables));
    assert_eq!(link, format!("{PLACE}{token}"));
    link
}

/// Returns the first line that the program prints.
fn link(program: &mut Child) -> String {
    let mut link = String::new();
    BufReader::new(program.stdout.as_mut().unwrap()).read_line(&mut link).unwrap();
    assert!(link.starts_with(PLACE), "{link}");
    link.trim_end().to_owned()
}

#[test]
fn a_goal_a_law_a_gain_and_the_services_are_set_by_the_page() {
    let mut host = Host::with_both_nodes();
    let link = view(&mut host, &[]);
    Browser::start(&host, "drive", &link).until("done");
    assert_eq!(host.parameter("controller"), "double_geodesic");
    assert_eq!(host.parameter("gains.double_geodesic"), "[1.0, 2.5]");
    host.signal("view", "INT");
    assert_eq!(host.wait("view"), Some(0));
}

#[test]
fn the_page_is_whole_on_every_screen_in_light_and_dark_and_by_keyboard() {
    let mut host = Host::with_both_nodes();
    let link = view(&mut host, &[]);
    Browser::start(&host, "looks", &link).until("done");
}

#[test]
fn a_bag_is_played_on_a_page_without_controls() {
    let mut host = Host::new();
    let link = view(&mut host, &[concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/bag_demo")]);
    Browser::start(&host, "bag", &link).until("done");
}

#[test]
fn without_webgl_the_arm_is_drawn_as_lines() {
    let mut host = Host::with_both_nodes();
    let link = view(&mut host, &[]);
    Browser::start(&host, "lines", &link).until("done");
}

#[test]
fn a_viewer_without_the_right_to_drive_has_no_controls() {
    let mut host = Host::with_both_nodes();
    let link = view(&mut host, &["--watch-only"]);
    Browser::start(&host, "watch", &link).until("done");
}

#[test]
fn a_lost_server_and_a_lost_servo_are_shown_and_found_again() {
    let mut host = Host::with_both_nodes();
    let link = view(&mut host, &[]);
    let mut browser = Browser::start(&host, "lost", &link);
    browser.until("open");
    host.kill("view");
    browser.until("server lost");
    view(&mut host, &[]);
    browser.until("server found");
    host.kill("servo");
    browser.until("servo lost");
    host.start("servo", &["servo"]);
    browser.until("servo found");
    host.kill("view");
    view_with(&mut host, &[], "another-token-than-before");
    browser.until("done");
}

/// The first second has no answers, then answers arrive.
#[test]
fn a_key_that_is_released_over_a_slow_link_leaves_three_twists_on_the_way() {
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/view/jog.mjs");
    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/src/view/page");
    assert_success(&Command::new("node").args([script, page]).output().expect("node"));
}

#[test]
fn keep_out_shapes_are_shown() {
    let keep_out = "keep_out:=['table half_space 0 0 1 -0.6', 'post box 0.6 0.3 -0.2 0.2 0.2 0.8', 'tent hull -0.6 0.2 -0.6 -0.2 0.2 -0.6 -0.4 0.6 -0.6 -0.4 0.3 0']";
    let mut host = Host::with_nodes(&[], &["--ros-args", "-p", "constraints:=true", "-p", keep_out]);
    let link = view(&mut host, &[]);
    Browser::start(&host, "keepOuts", &link).until("done");
}

#[test]
fn two_arms_are_shown_and_driven() {
    let mut host = Host::new();
    let link = link(host.start("demo", &["demo", "--dual", "--view"]));
    Browser::start(&host, "dual", &link).until("done");
    host.signal("demo", "INT");
    assert_eq!(host.wait("demo"), Some(0), "{}", host.errors("demo"));
}

#[test]
fn two_laws_race_side_by_side_from_where_the_last_motion_began() {
    // This is slow enough for a slow browser to see both in motion.
    let gains = ["gains.logc:=[0.5, 0.5]", "gains.double_geodesic:=[0.5, 0.5]"];
    let gains = gains.into_iter().flat_map(|gain| ["-p", gain]);
    let mut host = Host::with_nodes(&[], &["--ros-args"].into_iter().chain(gains).collect::<Vec<_>>());
    let link = view(&mut host, &[]);
    Browser::start(&host, "race", &link).until("done");
    // The watched arm is not affected.
    assert_eq!(host.parameter("controller"), "logc");
}

#[test]
fn joint_limits_are_shown_and_a_recording_is_begun_and_ended() {
    let directory = tempfile::tempdir().unwrap();
    let limits = ["lower:=[-1.0, -2.0, -3.0, -3.0, -3.0, -3.0]", "upper:=[2.5, 2.0, 3.0, 3.0, 3.0, 3.0]"]
        .map(|bound| format!("limits.joint_position_{bound}"));
    let mut host = Host::with_nodes(&[], &["--ros-args", "-p", &limits[0], "-p", &limits[1]]);
    let program =
        format!("cd {} && exec {} view", directory.path().display(), env!("CARGO_BIN_EXE_dq_servo"));
    let link = link(host.start_program("view", "sh", &["-c", &program]));
    Browser::start(&host, "record", &link).until("done");
    // The end of the view ends the second recording.
    host.signal("view", "INT");
    assert_eq!(host.wait("view"), Some(0));
    let bags: Vec<_> = directory.path().read_dir().unwrap().map(|entry| entry.unwrap().path()).collect();
    assert_eq!(bags.len(), 2, "{bags:?}");
    for bag in &bags {
        host.output(&["plot", bag.to_str().unwrap(), "--out", &format!("{}_plots", bag.display())]);
    }
}

/// The arm is a SCARA: its quill slides, and its task is a position.
#[test]
fn an_arm_that_slides_is_shown_in_millimetres_with_its_rail() {
    let mut host = Host::new();
    let robot = concat!("robot_file:=", env!("CARGO_MANIFEST_DIR"), "/tests/data/urdf/scara.urdf");
    let arm = ["--ros-args", "-p", robot, "-p", "base_frame:=link0", "-p", "tool_frame:=tool"];
    host.start("plant", &[&["arm"], &arm[..], &["-p", "initial_positions:=[0.4, 0.9, 0.2, -0.1]"]].concat());
    host.start_servo("servo", &[&arm[..], &["-p", "task:=position"]].concat());
    let link = view(&mut host, &[]);
    Browser::start(&host, "slides", &link).until("done");
    assert_eq!(host.parameter("task"), "position_and_axis");
}

/// Each of these signals would end the program silently by default.
#[test]
fn unrelated_signals_do_not_end_a_program_and_a_time_limit_does() {
    let mut host = Host::new();
    view(&mut host, &[]);
    for signal in ["USR1", "USR2", "ALRM", "VTALRM", "PROF", "IO", "STKFLT", "XFSZ", "34", "64"] {
        host.signal("view", signal);
        std::thread::sleep(Duration::from_millis(30));
    }
    host.signal("view", "XCPU");
    assert_eq!(host.wait("view"), Some(0));
}

#[test]
fn a_demo_without_a_terminal_offers_its_page_and_prints_its_table() {
    let mut host = Host::new();
    // The motion is slow, so that the browser connects in time.
    let arguments = ["demo", "--listen", "127.0.0.1:8123", "--ros-args", "-p", "gains.logc:=[0.25, 0.25]"];
    let demo = host.start_with("demo", &arguments, &[("DQ_SERVO_VIEW_TOKEN", TOKEN)]);
    let link = format!("{PLACE}{TOKEN}");
    wait_for_line(demo, &format!("watch the arm move: {link}"));
    Browser::start(&host, "demo", &link).until("done");
    let mut line = String::new();
    let mut output = BufReader::new(host.child("demo").stdout.take().unwrap());
    while !line.starts_with("diffc ") {
        line.clear();
        assert!(output.read_line(&mut line).unwrap() > 0, "{}", host.errors("demo"));
    }
    // A browser is watching.
    assert_eq!(host.child("demo").try_wait().unwrap(), None);
    host.signal("demo", "INT");
    assert_eq!(host.wait("demo"), Some(0), "{}", host.errors("demo"));
}

#[test]
fn the_demo_opens_the_page_moves_the_arm_and_ends_by_a_signal() {
    let mut host = Host::new();
    let link = link(host.start("demo", &["demo", "--view"]));
    Browser::start(&host, "demo", &link).until("done");
    host.signal("demo", "INT");
    assert_eq!(host.wait("demo"), Some(0), "{}", host.errors("demo"));
}
