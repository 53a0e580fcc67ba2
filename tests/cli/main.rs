//! Tests the command line without DDS: its output, and its answers to bad input.

mod cases;
mod examples;
mod imports;
mod input;
mod links;
mod named;
mod output;
mod packages;
mod readmes;
mod reproduce;
mod scripts;
mod streams;

use assert_cmd::Command;
use std::ffi::OsStr;
use std::process::Stdio;

/// Returns the program with these arguments, without the caller's ROS domain.
pub fn dq_servo(arguments: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_dq_servo"));
    command.args(arguments.split_whitespace()).env_remove("ROS_DOMAIN_ID");
    command
}

/// Returns the code, and stderr if it is valid text.
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

/// Returns the words of a line as arguments.
pub fn words(line: &str) -> Vec<&OsStr> {
    line.split_whitespace().map(OsStr::new).collect()
}
