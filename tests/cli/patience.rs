//! What runs the tests: which ones it runs again, with a cargo that fails as it is asked to.

use std::os::unix::fs::PermissionsExt;
use std::process::Command;

/// As cargo does where a test of two fails, and on a machine that stands still if `$STILL`: the second time it passes.
const CARGO: &str = r#"#!/bin/sh
cd "$(dirname "$0")" && echo "$*" >> calls
echo '     Running tests/dds/main.rs (target/debug/deps/dds-0123456789abcdef)'
[ -n "$STILL" ] && { sleep 0.1; kill -STOP $PPID; sleep 0.3; kill -CONT $PPID; }
if [ "$(wc -l < calls)" = 1 ] || [ -n "$NEVER" ]; then
    echo 'test graph::one ... ok'
    echo 'test graph::two ... FAILED'
    [ -z "$CRASH" ] && echo 'test result: FAILED. 1 passed; 1 failed'
    printf 'error: 1 target failed:\n    `--test dds`\n'
    exit 101
fi
echo 'test result: ok. 1 passed; 0 failed'
"#;

/// The exit code of the tests, and with what cargo was called.
fn tests(variables: &[&str]) -> (Option<i32>, Vec<String>) {
    let directory = tempfile::tempdir().unwrap();
    let cargo = directory.path().join("cargo");
    std::fs::write(&cargo, CARGO).unwrap();
    std::fs::set_permissions(&cargo, PermissionsExt::from_mode(0o755)).unwrap();
    let path = format!("{}:{}", directory.path().display(), std::env::var("PATH").unwrap());
    let mut command = Command::new(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/patient.py"));
    let output = command.arg("--locked").env("PATH", path).envs(variables.iter().map(|name| (name, "1")));
    let code = output.output().unwrap().status.code();
    let calls = std::fs::read_to_string(directory.path().join("calls")).unwrap();
    (code, calls.lines().map(str::to_owned).collect())
}

#[test]
fn what_failed_on_a_machine_that_stood_still_is_run_again() {
    let first = "test --locked --no-fail-fast";
    let again = "test --locked --test dds --no-fail-fast -- --exact graph::two";
    assert_eq!(tests(&["STILL"]), (Some(0), vec![first.to_owned(), again.to_owned()]));
    assert_eq!(tests(&[]), (Some(1), vec![first.to_owned()]), "a failure is one on a machine that goes on");
}

#[test]
fn what_crashed_or_fails_for_ever_is_a_failure() {
    let (code, calls) = tests(&["STILL", "CRASH"]);
    assert_eq!((code, calls.len()), (Some(1), 1), "who knows what else there was");
    let (code, calls) = tests(&["STILL", "NEVER"]);
    assert_eq!((code, calls.len()), (Some(1), 3));
}
