//! The command line without DDS: what it prints, and how it answers bad input.

mod cases;
mod examples;
mod imports;
mod input;
mod links;
mod output;
mod readmes;
mod reproduce;
mod scripts;
mod streams;

use assert_cmd::Command;
use std::ffi::OsStr;
use std::process::Stdio;

/// The program with these arguments, in no domain of its caller's.
pub fn dq_servo(arguments: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_dq_servo"));
    command.args(arguments.split_whitespace()).env_remove("ROS_DOMAIN_ID");
    command
}

/// The code, and what came on stderr if that can be read.
pub fn run(
    arguments: &[&OsStr],
    stdout: impl Into<Stdio>,
    stderr: impl Into<Stdio>,
) -> (Option<i32>, String) {
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_dq_servo"));
    let command = command.args(arguments).env_remove("ROS_DOMAIN_ID").env("RUST_BACKTRACE", "0");
    let output = command.stdout(stdout).stderr(stderr).spawn().unwrap().wait_with_output().unwrap();
    (output.status.code(), String::from_utf8(output.stderr).unwrap())
}

/// The words of a line, as arguments.
pub fn words(line: &str) -> Vec<&OsStr> {
    line.split_whitespace().map(OsStr::new).collect()
}
