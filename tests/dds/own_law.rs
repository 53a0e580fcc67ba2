//! Tests programs of users. One has its own law: the arm moves by it, and it is compared, drawn and replayed like the built-in
//! ones. The other one is a node.

use crate::host::{Host, assert_success};
use crate::replay::place;
use dq_studies::compare::{ALL_ARMS, Findings, Gain};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::process::Output;

const LAW: &str = "boundary_layer";
/// The first color that is not the color of a built-in law, in SVG format.
const COLOR: &str = "#CC3C8C";

/// Returns the program of this example.
fn example(name: &str) -> PathBuf {
    Path::new(env!("CARGO_BIN_EXE_dq_servo")).with_file_name("examples").join(name)
}

#[test]
fn the_example_node_is_one_for_clients_of_both_vendors() {
    let mut host = Host::new();
    host.start_program("counter", example("counter").to_str().unwrap(), &[]);
    host.peer(&["counter"]);
}

/// Runs the example program `own_law` until it ends.
fn run(host: &Host, arguments: &[&str]) -> Output {
    host.command("timeout").arg("120").arg(example("own_law")).args(arguments).output().unwrap()
}

#[test]
fn a_registered_law_drives_the_arm_and_its_run_is_drawn_in_its_colour_and_replayed() {
    let (host, (directory, bag)) = (Host::new(), place());
    let (text, plots) = (bag.to_str().unwrap(), directory.path().join("plots"));
    let gains = ["--ros-args", "-p", "controller:=boundary_layer", "-p", "gains.boundary_layer:=[0.5, 0.5]"];
    let demo = run(&host, &[&["demo", "--json", "--record", text], &gains[..]].concat());
    assert_success(&demo);
    let motions: Value = serde_json::from_slice(&demo.stdout).unwrap();
    assert_eq!(motions[0]["law"], json!(LAW), "{motions}");
    let plot = run(&host, &["plot", text, "--out", plots.to_str().unwrap()]);
    assert_success(&plot);
    let drawn = std::fs::read_to_string(plots.join("path.svg")).unwrap();
    assert!(drawn.contains(COLOR), "{}", &drawn[..1000]);
    let replay = run(&host, &["replay", text]);
    assert_success(&replay);
    let told = String::from_utf8(replay.stdout).unwrap();
    assert!(told.contains(" 0 differ"), "{told}");
    // A program that does not know the law cannot replay it.
    assert!(!host.run(&["replay", text]).status.success());
}

#[test]
fn a_registered_law_is_compared_with_the_others() {
    let (host, directory) = (Host::new(), tempfile::tempdir().unwrap());
    let committed: Findings = serde_json::from_str(include_str!("../data/compare.json")).unwrap();
    let mut gains: Vec<Gain> = committed.gains.into_iter().filter(|gain| gain.arm == "puma560").collect();
    // The gains of the own law are listed after those of the built-in laws, for equal settling time and for equal peak speed.
    for place in [12, 25] {
        let own = Gain { law: LAW.to_owned(), gain: 0.5, ..gains[place - 1].clone() };
        gains.insert(place, own);
    }
    std::fs::write(directory.path().join("gains.json"), serde_json::to_string(&gains).unwrap()).unwrap();
    let out = directory.path().to_str().unwrap();
    assert_success(&run(&host, &["compare", "--arm", "puma560", "--tasks", "2", "--out", out]));
    let read = |name: &str| std::fs::read_to_string(directory.path().join(name)).unwrap();
    let findings: Findings = serde_json::from_str(&read("compare.json")).unwrap();
    let cells = findings.cells.iter().filter(|cell| cell.key.law == LAW && cell.key.arm == ALL_ARMS);
    assert_eq!(cells.map(|cell| cell.runs).sum::<usize>(), 2 * 14, "two tasks under fourteen conditions");
    assert!(read("what_the_laws_do.md").contains("| boundary_layer | 0.500 |"));
    assert!(read("compare_laws.svg").contains(COLOR));
}
