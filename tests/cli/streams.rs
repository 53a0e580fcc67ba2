//! Tests full, broken and closed streams, and a system without threads.

use crate::{dq_servo, run, words};
use assert_cmd::Command;
use std::fs::{self, File};
use std::process::Stdio;

/// Commands that print in different ways.
const PRINTING: [&str; 5] =
    ["pose 1 2 3 4 5 6", "pose --json 1 2 3 4 5 6", "--help", "goal --help", "--version"];

#[test]
fn a_full_disk_fails_with_one_line() {
    for arguments in PRINTING {
        let full = || File::create("/dev/full").unwrap();
        let (code, message) = run(&words(arguments), full(), Stdio::piped());
        assert_eq!(code, Some(1), "{arguments}");
        assert!(message.contains("stdout: No space left"), "{message}");
        assert_eq!(message.lines().count(), 1, "{message}");
        assert_eq!(run(&words(arguments), full(), full()).0, Some(1), "{arguments}");
    }
    assert_eq!(run(&words("pose 1"), Stdio::null(), File::create("/dev/full").unwrap()).0, Some(2));
}

/// A file size limit of zero replaces a full disk: writes fail in the same way.
#[test]
fn a_full_disk_ends_a_comparison_as_a_failure_and_not_as_a_usage_error() {
    let folder = tempfile::tempdir().unwrap();
    // The gains are those that were committed; choosing them again takes half a minute.
    let committed = include_str!("../data/compare.json");
    let mut committed: serde_json::Value = serde_json::from_str(committed).unwrap();
    let gains = committed["gains"].as_array_mut().unwrap();
    gains.retain(|gain| gain["arm"] == "puma560");
    fs::write(folder.path().join("gains.json"), serde_json::to_string(gains).unwrap()).unwrap();
    let compare =
        format!("ulimit -f 0; exec {} compare --tasks 1 --arm puma560 --out", env!("CARGO_BIN_EXE_dq_servo"));
    let output =
        Command::new("sh").args(["-c", &format!("{compare} {}", folder.path().display())]).assert().code(1);
    let message = String::from_utf8(output.get_output().stderr.clone()).unwrap();
    // Lines of progress may precede it.
    let last = message.lines().last().unwrap();
    assert!(last.starts_with("error: ") && last.contains("tasks.jsonl: File too large"), "{message}");
}

#[test]
fn a_reader_that_closes_stdout_is_not_a_failure() {
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
fn one_line_reports_that_no_thread_can_be_started() {
    let compare = concat!("compare --out ", env!("CARGO_TARGET_TMPDIR"), "/compared");
    for arguments in ["servo", "puma560", "param list", "goal 0 0 0 0 0 0 1", compare] {
        // This is like `ulimit -u`, but also affects root: no thread can get a stack of this size.
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
