//! Tests the package in a colcon workspace, where `ros2 run` and `ros2 launch` must find it.

use crate::host::{PYTHON, assert_success};
use std::process::Command;

/// Finds what `ros2 run dq_servo dq_servo --version` and `ros2 launch dq_servo NAME` need, by the index of ament.
const FIND: &str = r#"
import json, os, pathlib, subprocess, sys, xml.etree.ElementTree as xml

prefixes = [pathlib.Path(p) for p in os.environ["AMENT_PREFIX_PATH"].split(":")]
[prefix] = [p for p in prefixes if (p / "share/ament_index/resource_index/packages/dq_servo").is_file()]
share = prefix / "share/dq_servo"
manifest = xml.parse(share / "package.xml").getroot()
assert manifest.find("name").text == "dq_servo" and manifest.find("license").text == "Apache-2.0"
program = prefix / "lib/dq_servo/dq_servo"
version = subprocess.run([program, "--version"], check=True, capture_output=True, text=True).stdout
assert version.split() == ["dq_servo", manifest.find("version").text], version

# `rviz2 -d $(ros2 pkg prefix --share dq_servo)/rviz/dq_servo.rviz`, and the arms of the box for params_file.
assert (share / "rviz/dq_servo.rviz").is_file()
arms = sorted(file.stem for file in (share / "msg_config/arms").iterdir())
assert "ur5e" in arms and len(arms) == 8, arms

for name in ("dq_servo.launch.py", "dq_dual_servo.launch.py"):
    [file] = [pathlib.Path(folder) / name for folder, _, files in os.walk(share) if name in files]
    launched = subprocess.run([sys.executable, sys.argv[1], file], check=True, capture_output=True, text=True).stdout
    defaults = json.loads(launched)["arguments"]
    assert pathlib.Path(defaults["program"]) == program, defaults
    params_file = defaults["params_file"]
    assert not params_file or pathlib.Path(params_file).is_relative_to(share) and os.path.exists(params_file), defaults
"#;

const LAUNCH_FILES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/stock/launch_files.py");

const COLCON: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/target/venv/bin/colcon");

/// Installs into a workspace that colcon has built with these arguments.
fn install_and_find(build: &[&str]) {
    let workspace = tempfile::tempdir().unwrap();
    let built = Command::new(COLCON).arg("build").args(build).current_dir(workspace.path()).output();
    assert_success(&built.unwrap());
    // Install twice, because existing files are replaced.
    for _ in 0..2 {
        let script = concat!(env!("CARGO_MANIFEST_DIR"), "/launch_scripts/install_into_workspace.sh");
        let program = env!("CARGO_BIN_EXE_dq_servo");
        assert_success(
            &Command::new(script).arg(workspace.path()).env("DQ_SERVO", program).output().unwrap(),
        );
    }
    let found = Command::new("bash")
        .args(["-c", ". install/setup.bash && exec \"$0\" -c \"$1\" \"$2\"", PYTHON, FIND, LAUNCH_FILES])
        .env_remove("AMENT_PREFIX_PATH")
        .current_dir(workspace.path())
        .output();
    assert_success(&found.unwrap());
}

#[test]
fn a_workspace_with_a_folder_for_each_package_has_the_package() {
    install_and_find(&[]);
}

#[test]
fn a_merged_workspace_has_the_package() {
    install_and_find(&["--merge-install"]);
}

#[test]
fn an_invalid_workspace_is_rejected_and_nothing_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/launch_scripts/install_into_workspace.sh");
    let output = Command::new(script).arg(folder.path()).output().unwrap();
    let error = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(error.contains("run 'colcon build'") && error.lines().count() == 1, "{error}");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}
