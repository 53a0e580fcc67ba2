//! Nodes on Fast DDS (peer.cpp) beside servo and plant.

use crate::host::{Host, assert_success};
use std::process::Command;
use std::sync::OnceLock;

/// The peer, built by the first test; `libfastrtps-dev` brings the library.
fn peer() -> &'static str {
    static PEER: OnceLock<&str> = OnceLock::new();
    PEER.get_or_init(|| {
        let program = concat!(env!("CARGO_TARGET_TMPDIR"), "/fastdds_peer");
        let source = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/stock/peer.cpp");
        let build = Command::new("g++")
            .args(["-std=c++17", "-O1", "-o", program, source, "-lfastrtps", "-lfastcdr"])
            .output()
            .expect("g++");
        assert_success(&build);
        program
    })
}

fn run(host: &Host, case: &[&str]) {
    assert_success(&host.command("timeout").args(["120", peer()]).args(case).output().unwrap());
}

#[test]
fn no_goal_of_a_publisher_that_leaves_at_once_is_lost() {
    let host = Host::with_both_nodes();
    run(&host, &["goals", "200"]);
    run(&host, &["taken", "200"]);
}
