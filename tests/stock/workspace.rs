//! Tests the package in a colcon workspace, where `ros2 run` and `ros2 launch` must find it.

use crate::host::{PYTHON, assert_success};
use std::process::Command;

const FIND: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/stock/find_package.py");

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
        .args(["-c", ". install/setup.bash && exec \"$0\" \"$1\"", PYTHON, FIND])
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
