//! Tests that the recipes of the guide's page on teleoperation do what the page says: the arm moves while a simulated device moves, and stops
//! when the device lets go.

use super::{assert_success, python};
use crate::host::{Host, wait_for_line};
use std::path::{Path, PathBuf};

const ROOT: &str = env!("CARGO_MANIFEST_DIR");
const PAGE: &str = include_str!("../../src/guide/teleoperation.md");

/// How often each device moves and lets go. The medians of the page are of 20 rounds.
fn rounds() -> String {
    std::env::var("TELEOPERATION_ROUNDS").unwrap_or_else(|_| "2".to_owned())
}

/// Returns the blocks of the page in this language.
fn blocks(language: &str) -> Vec<&'static str> {
    let start = format!("\n```{language}\n");
    PAGE.split(&start).skip(1).map(|rest| rest.split("```").next().unwrap()).collect()
}

/// Returns the command of the page that has this text in it.
fn command(text: &str) -> String {
    let commands: Vec<_> = blocks("sh").iter().map(|block| block.replace("\\\n", " ")).collect();
    let line = commands.iter().flat_map(|block| block.lines()).find(|line| line.contains(text));
    line.unwrap_or_else(|| panic!("no command of the page has {text:?}")).to_owned()
}

/// Returns a new folder with the programs of the page, and with the folders of this repository that the commands name.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("teleoperation").join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    for program in blocks("python") {
        let name = program.lines().next().unwrap().trim_start_matches("# ");
        std::fs::write(folder.join(name), program).unwrap();
    }
    std::os::unix::fs::symlink(format!("{ROOT}/launch_scripts"), folder.join("launch_scripts")).unwrap();
    folder
}

/// Runs the page's arm and servo, and its commands with these texts in them, while `device` is used.
fn teleoperate(device: &str, commands: &[&str]) {
    let (mut host, folder) = (Host::new(), folder(device));
    let python = python("jazzy");
    let programs = [
        format!("{ROOT}/tests/ros2/stand_ins"),
        Path::new(&python).parent().unwrap().display().to_string(),
        Path::new(env!("CARGO_BIN_EXE_dq_servo")).parent().unwrap().display().to_string(),
        std::env::var("PATH").unwrap(),
    ];
    let environment = format!(
        "cd '{folder}' && export PATH='{}' PYTHONPATH='{}' SPACEMOUSE='{folder}/mouse'",
        programs.join(":"),
        programs[0],
        folder = folder.display()
    );
    for text in ["dq_servo arm", "dq_servo servo"].iter().chain(commands) {
        let script = format!("{environment} && exec {}", command(text));
        let child = host.start_program(text, "sh", &["-c", &script]);
        if *text == "dq_servo servo" {
            wait_for_line(child, "waiting_for_state -> holding");
        }
    }
    let script =
        format!("{environment} && exec python3 {ROOT}/tests/ros2/teleoperation.py {device} {}", rounds());
    let used = host.command("timeout").args(["200", "sh", "-c", &script]).output().unwrap();
    println!("{device}: {}", String::from_utf8_lossy(&used.stdout));
    assert_success(&used);
}

#[test]
fn a_stick_and_one_that_is_unplugged_jog() {
    teleoperate("stick", &[]);
    teleoperate("unplugged", &[]);
}

#[test]
fn a_joystick_jogs() {
    teleoperate("watch", &["teleop_twist_joy"]);
}

#[test]
fn a_spacemouse_jogs() {
    teleoperate("spacemouse", &["spacemouse.py"]);
}

#[test]
fn a_hand_with_a_clutch_is_followed() {
    teleoperate("hand", &["hand.py"]);
}

#[test]
fn a_simulated_hand_is_followed() {
    teleoperate("watch", &["hand.py", "simulated_device.py"]);
}

#[test]
fn a_phone_is_followed() {
    teleoperate("phone", &["teleop.ros2"]);
}

#[test]
fn a_phone_whose_page_is_closed_is_followed_no_longer() {
    teleoperate("closed_phone", &["teleop.ros2"]);
}
